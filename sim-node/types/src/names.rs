//! Names and numbers of enums.

/// Gives an enum its names, and the conversions from names and numbers: `names!(Method: Xpbd = "xpbd", Pbd = "pbd");`.
macro_rules! names {
    ($type:ident: $($variant:ident = $name:literal),+ $(,)?) => {
        impl $type {
            /// All values, by ascending number.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// Name in scenes, commands and logs.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }

            /// Returns the value with this name.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|one| one.name() == name)
            }

            /// Returns the value with this number.
            pub fn from_number(number: u32) -> Option<Self> {
                Self::ALL.into_iter().find(|one| *one as u32 == number)
            }
        }
    };
}

pub(crate) use names;
