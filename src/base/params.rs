//! The one parameter pattern: a struct, its defaults, its ranges and its schema from one list.
//!
//! Command-line flags, the Python keywords' checks and the documentation come from the schema, so
//! a default value is written exactly once.

/// A type that a parameter can have.
pub trait Value: Clone + Sized {
    /// Name of the type for people: `"integer"`, `"number"`, ...
    const KIND: &'static str;
    /// The words accepted, if there is a fixed list of them.
    const CHOICES: &'static [&'static str] = &[];
    /// Reads the value from text; `None` if it cannot be one.
    fn parse(text: &str) -> Option<Self>;
    /// Writes the value so that [`Value::parse`] reads it back.
    fn show(&self) -> String;
    /// What [`Value::parse`] accepts, for error messages.
    fn expected() -> String {
        if Self::CHOICES.is_empty() {
            format!("a{} {}", if Self::KIND.starts_with('i') { "n" } else { "" }, Self::KIND)
        } else {
            format!("one of {}", Self::CHOICES.join(", "))
        }
    }
}

macro_rules! number {
    ($($t:ty: $kind:literal),*) => {$(
        impl Value for $t {
            const KIND: &'static str = $kind;
            fn parse(text: &str) -> Option<Self> { text.trim().parse().ok() }
            fn show(&self) -> String { self.to_string() }
        }
    )*};
}
number!(usize: "integer", u64: "integer", f32: "number");

/// A value that may be left out: `none`.
impl Value for Option<f32> {
    const KIND: &'static str = "optional number";

    fn parse(text: &str) -> Option<Self> {
        if text == "none" { Some(None) } else { f32::parse(text).map(Some) }
    }

    fn show(&self) -> String {
        self.as_ref().map_or_else(|| "none".into(), f32::show)
    }

    fn expected() -> String {
        "a number, or none".into()
    }
}

/// One parameter as the faces see it.
#[derive(Debug, Clone)]
pub struct Param {
    /// Name, with underscores.
    pub name: &'static str,
    /// Name of the type for people.
    pub kind: &'static str,
    /// The words accepted, if there is a fixed list.
    pub choices: &'static [&'static str],
    /// Default, as text.
    pub default: String,
    /// Accepted range, as text; empty if any value of the type will do.
    pub range: String,
    /// Unit; empty if none.
    pub unit: &'static str,
    /// What it does.
    pub doc: String,
}

/// Declares an enum whose variants have fixed names and that is a parameter [`Value`].
macro_rules! choice {
    ($(#[$meta:meta])* pub enum $name:ident { $($(#[$vmeta:meta])* $variant:ident = $word:literal),+ $(,)? }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $name { $($(#[$vmeta])* $variant),+ }
        impl $crate::base::params::Value for $name {
            const KIND: &'static str = "choice";
            const CHOICES: &'static [&'static str] = &[$($word),+];
            fn parse(text: &str) -> Option<Self> {
                match text { $($word => Some(Self::$variant),)+ _ => None }
            }
            fn show(&self) -> String {
                match self { $(Self::$variant => $word),+ }.to_owned()
            }
        }
    };
}
pub(crate) use choice;

/// Declares a parameter struct. Each field: doc, `name: Type = default`, then optionally
/// `, in LO..=HI` and `, unit "..."`.
macro_rules! params {
    (
        $(#[$meta:meta])*
        pub struct $name:ident for $verb:literal {
            $(
                $(#[doc = $doc:literal])+
                $field:ident: $type:ty = $default:expr
                $(, in $lo:literal..=$hi:literal)?
                $(, unit $unit:literal)?;
            )+
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name { $($(#[doc = $doc])+ pub $field: $type),+ }

        impl Default for $name {
            fn default() -> Self { Self { $($field: $default),+ } }
        }

        impl $name {
            /// The verb that takes these parameters.
            pub const VERB: &'static str = $verb;

            /// Every parameter, in order of declaration.
            pub fn schema() -> Vec<$crate::base::params::Param> {
                use $crate::base::params::Value;
                let default = Self::default();
                vec![$($crate::base::params::Param {
                    name: stringify!($field),
                    kind: <$type as Value>::KIND,
                    choices: <$type as Value>::CHOICES,
                    default: default.$field.show(),
                    range: String::new() $(+ &format!("{} to {}", $lo, $hi))?,
                    unit: concat!($($unit)?),
                    doc: [$($doc.trim()),+].join(" "),
                }),+]
            }

            /// Sets one parameter from text.
            ///
            /// # Errors
            /// [`Error::Parameter`](crate::Error::Parameter) for an unknown name or a value that
            /// is not of the parameter's type; ranges are checked by `validate`.
            pub fn set(&mut self, name: &str, text: &str) -> $crate::base::error::Result<()> {
                use $crate::base::params::Value;
                match name {
                    $(stringify!($field) => {
                        self.$field = <$type as Value>::parse(text).ok_or_else(|| {
                            $crate::base::error::Error::parameter(
                                stringify!($field), <$type as Value>::expected(), format!("`{text}`"))
                        })?;
                        Ok(())
                    })+
                    _ => Err($crate::base::error::Error::parameter(
                        $verb, format!("given known parameters ({})", [$(stringify!($field)),+].join(", ")),
                        format!("`{name}`"))),
                }
            }

            /// The defaults with what `text` says for a parameter's name, checked as by `validate`.
            ///
            /// # Errors
            /// [`Error::Parameter`](crate::Error::Parameter) naming the first that fails.
            pub fn from_texts<'a>(
                text: impl Fn(&'static str) -> Option<&'a str>,
            ) -> $crate::base::error::Result<Self> {
                let mut params = Self::default();
                $(if let Some(text) = text(stringify!($field)) {
                    params.set(stringify!($field), text)?;
                })+
                params.validate()?;
                Ok(params)
            }

            /// Every parameter as text, in order of declaration.
            pub fn show(&self) -> Vec<(&'static str, String)> {
                use $crate::base::params::Value;
                vec![$((stringify!($field), self.$field.show())),+]
            }

            /// Checks every range; NaN is in none.
            ///
            /// # Errors
            /// [`Error::Parameter`](crate::Error::Parameter) naming the first that fails.
            pub fn validate(&self) -> $crate::base::error::Result<()> {
                $($(
                    if !($lo..=$hi).contains(&self.$field) {
                        return Err($crate::base::error::Error::parameter(
                            stringify!($field), format!("{} to {}", $lo, $hi), self.$field));
                    }
                )?)+
                Ok(())
            }
        }
    };
}
pub(crate) use params;
