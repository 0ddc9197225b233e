//! The stand-alone `texforge` program: hands its arguments to [`texforge::cli::run`].

fn main() -> std::process::ExitCode {
    texforge::cli::run(std::env::args_os()).into()
}
