//! The one error type. Every variant says what is wrong, why, and what to do.

use std::path::PathBuf;

/// Result with [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Everything that can go wrong, by whose fault: parameter, picture, limit, environment, cancel.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is outside its range or contradicts another.
    #[error("`{name}` must be {expected}, got {got}")]
    Parameter {
        /// Name as in the Rust struct, the Python keyword and (with `-` for `_`) the flag.
        name: &'static str,
        /// What would be accepted.
        expected: String,
        /// What was given.
        got: String,
    },
    /// A picture has too few pixels for what is asked of it.
    #[error("{what} is {width}x{height} pixels, at least {need}x{need} are needed; {remedy}")]
    TooSmall {
        /// Which picture.
        what: String,
        /// Its width in pixels.
        width: usize,
        /// Its height in pixels.
        height: usize,
        /// The least side in pixels.
        need: usize,
        /// What the user can do about it.
        remedy: String,
    },
    /// The mask (or the alpha channel) leaves no whole patch to copy from.
    #[error(
        "the mask leaves no {patch}x{patch} patch to copy from ({usable} usable pixels); \
         mark more of the photo as usable or choose a smaller patch"
    )]
    EmptyMask {
        /// Usable pixels.
        usable: usize,
        /// Patch side.
        patch: usize,
    },
    /// NaN or infinite samples.
    #[error(
        "{what} holds {count} NaN or infinite samples, the first at row {y}, column {x}; \
         replace them or mask them out"
    )]
    NotFinite {
        /// Which picture.
        what: String,
        /// How many samples.
        count: usize,
        /// Row of the first.
        y: usize,
        /// Column of the first.
        x: usize,
    },
    /// Two pictures that belong together differ in size.
    #[error("{what} is {got_w}x{got_h} pixels, expected {want_w}x{want_h}; {remedy}")]
    SizeMismatch {
        /// Which picture.
        what: String,
        /// Its width.
        got_w: usize,
        /// Its height.
        got_h: usize,
        /// The width it should have.
        want_w: usize,
        /// The height it should have.
        want_h: usize,
        /// What the user can do about it.
        remedy: String,
    },
    /// A picture whose samples cannot be what they claim to be.
    #[error("{what}: {reason}")]
    BadPicture {
        /// Which picture.
        what: String,
        /// What is wrong with it and what to do.
        reason: String,
    },
    /// A picture without the structure that is asked for; it may be used in another way.
    #[error(
        "the photo has no clear {what} (confidence {confidence:.2}, {least:.2} is needed); {remedy}"
    )]
    NoStructure {
        /// Which structure.
        what: String,
        /// How sure it is that there is one, in 0..=1.
        confidence: f64,
        /// The confidence that is needed.
        least: f64,
        /// What the user can do about it.
        remedy: String,
    },
    /// The document of a procedural texture is damaged or of a later version.
    #[error("this is no procedural texture: {reason}; make one with `texforge noise fit`")]
    Document {
        /// What is wrong with it.
        reason: String,
    },
    /// The work would not fit into memory; nothing was allocated.
    #[error(
        "{what} needs about {need_mib} MiB of memory, {available_mib} MiB are available; \
         choose a smaller size"
    )]
    Memory {
        /// The work.
        what: String,
        /// Estimate in MiB.
        need_mib: u64,
        /// Available in MiB.
        available_mib: u64,
    },
    /// A file is not what its name or its header says.
    #[error("cannot read {}: {reason}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// A file format that is unknown or cannot hold the picture.
    #[error("{}: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Why, and which formats would do.
        reason: String,
    },
    /// The operating system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// "read", "write", ...
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The system's own error.
        source: std::io::Error,
    },
    /// The output exists already.
    #[error("{} exists already; choose another name or allow overwriting (--force)", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// Output and input are the same file.
    #[error("{} is also an input; choose another output name", path.display())]
    SameFile {
        /// The file.
        path: PathBuf,
    },
    /// The caller cancelled.
    #[error("cancelled")]
    Cancelled,
    /// A bug of texforge, caught before it could reach the caller as a panic.
    #[error("internal error: {message}; please report it with the picture and the parameters")]
    Internal {
        /// The panic's message.
        message: String,
    },
}

/// Stable name of an [`Error`]'s kind, for programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum ErrorKind {
    /// See [`Error::Parameter`].
    Parameter,
    /// See [`Error::TooSmall`].
    TooSmall,
    /// See [`Error::EmptyMask`].
    EmptyMask,
    /// See [`Error::NotFinite`].
    NotFinite,
    /// See [`Error::SizeMismatch`].
    SizeMismatch,
    /// See [`Error::BadPicture`].
    BadPicture,
    /// See [`Error::NoStructure`].
    NoStructure,
    /// See [`Error::Document`].
    Document,
    /// See [`Error::Memory`].
    Memory,
    /// See [`Error::Decode`].
    Decode,
    /// See [`Error::Format`].
    Format,
    /// See [`Error::Io`].
    Io,
    /// See [`Error::Exists`].
    Exists,
    /// See [`Error::SameFile`].
    SameFile,
    /// See [`Error::Cancelled`].
    Cancelled,
    /// See [`Error::Internal`].
    Internal,
}

impl ErrorKind {
    /// Every kind, in declaration order.
    pub const ALL: [Self; 16] = [
        Self::Parameter,
        Self::TooSmall,
        Self::EmptyMask,
        Self::NotFinite,
        Self::SizeMismatch,
        Self::BadPicture,
        Self::NoStructure,
        Self::Document,
        Self::Memory,
        Self::Decode,
        Self::Format,
        Self::Io,
        Self::Exists,
        Self::SameFile,
        Self::Cancelled,
        Self::Internal,
    ];

    /// The slug, e.g. `"too_small"`.
    pub fn slug(self) -> &'static str {
        match self {
            Self::Parameter => "parameter",
            Self::TooSmall => "too_small",
            Self::EmptyMask => "empty_mask",
            Self::NotFinite => "not_finite",
            Self::SizeMismatch => "size_mismatch",
            Self::BadPicture => "bad_picture",
            Self::NoStructure => "no_structure",
            Self::Document => "document",
            Self::Memory => "memory",
            Self::Decode => "decode",
            Self::Format => "format",
            Self::Io => "io",
            Self::Exists => "exists",
            Self::SameFile => "same_file",
            Self::Cancelled => "cancelled",
            Self::Internal => "internal",
        }
    }
}

impl Error {
    /// The kind, for programs.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Parameter { .. } => ErrorKind::Parameter,
            Self::TooSmall { .. } => ErrorKind::TooSmall,
            Self::EmptyMask { .. } => ErrorKind::EmptyMask,
            Self::NotFinite { .. } => ErrorKind::NotFinite,
            Self::SizeMismatch { .. } => ErrorKind::SizeMismatch,
            Self::BadPicture { .. } => ErrorKind::BadPicture,
            Self::NoStructure { .. } => ErrorKind::NoStructure,
            Self::Document { .. } => ErrorKind::Document,
            Self::Memory { .. } => ErrorKind::Memory,
            Self::Decode { .. } => ErrorKind::Decode,
            Self::Format { .. } => ErrorKind::Format,
            Self::Io { .. } => ErrorKind::Io,
            Self::Exists { .. } => ErrorKind::Exists,
            Self::SameFile { .. } => ErrorKind::SameFile,
            Self::Cancelled => ErrorKind::Cancelled,
            Self::Internal { .. } => ErrorKind::Internal,
        }
    }

    /// Shorthand for [`Error::Parameter`].
    pub fn parameter(
        name: &'static str,
        expected: impl Into<String>,
        got: impl std::fmt::Display,
    ) -> Self {
        Self::Parameter { name, expected: expected.into(), got: got.to_string() }
    }

    /// Shorthand for [`Error::Io`], to be used with `map_err`.
    pub fn io(
        action: &'static str,
        path: impl Into<PathBuf>,
    ) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io { action, path, source }
    }
}

/// Runs `work`; a panic inside (a bug of ours) comes back as [`Error::Internal`].
pub(crate) fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let message = panic
            .downcast_ref::<String>()
            .cloned()
            .or_else(|| panic.downcast_ref::<&str>().map(ToString::to_string))
            .unwrap_or_else(|| "panic without a message".into());
        Err(Error::Internal { message })
    })
}
