//! Code generated from the list of laws: their enums, the dispatch to each law, and all declarations.

/// Makes the enums of laws, and the macros that run code for whichever law it is, from the list of
/// laws. `$` stands first because the macros that are made need it.
macro_rules! register {
    ($d:tt $($file:ident :: $law:ident),+ $(,)?) => {
        $(pub use $file::$law;)+

        /// One of the laws.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[expect(clippy::large_enum_variant, reason = "there is one a body, not one a point")]
        pub enum AnyLaw {
            $($law($law),)+
        }

        $(
            impl From<$law> for AnyLaw {
                fn from(law: $law) -> Self {
                    Self::$law(law)
                }
            }
        )+

        /// The laws of the own and of the far end of bonds.
        #[derive(Debug, Clone, Copy)]
        pub enum PairLaw {
            $($law([$law; 2]),)+
            /// Different laws at the two ends.
            Mixed([AnyLaw; 2]),
        }

        impl PairLaw {
            /// From the laws of the own and of the far end.
            pub fn new(here: AnyLaw, there: AnyLaw) -> Self {
                match (here, there) {
                    $((AnyLaw::$law(here), AnyLaw::$law(there)) => Self::$law([here, there]),)+
                    _ => Self::Mixed([here, there]),
                }
            }

            /// The laws of points i and j.
            pub fn laws(&self) -> [AnyLaw; 2] {
                match *self {
                    $(Self::$law([i, j]) => [i.into(), j.into()],)+
                    Self::Mixed(laws) => laws,
                }
            }
        }

        /// Runs code for whichever law an [`AnyLaw`] is; compiled for each.
        macro_rules! with_law {
            ($d any:expr, $d law_name:ident => $d body:expr) => {
                match $d any {
                    $($crate::material::AnyLaw::$law($d law_name) => $d body,)+
                }
            };
        }
        pub(crate) use with_law;

        /// Runs code for whichever laws a [`PairLaw`] has; compiled for each.
        macro_rules! with_pair {
            ($d pair:expr, $d laws:ident => $d body:expr) => {
                match $d pair {
                    $($crate::material::PairLaw::$law($d laws) => $d body,)+
                    $crate::material::PairLaw::Mixed($d laws) => $d body,
                }
            };
        }
        pub(crate) use with_pair;

        /// Counts of the numbers of each law in three dimensions.
        const COUNTS: &[Counts] = &[$(Counts::of::<$law, 3>()),+];

        const DECLARATIONS: &[&[Declaration]] = &[$(<$law as Declared>::DECLARATIONS),+];

        /// The declarations of all laws.
        pub fn declarations() -> impl Iterator<Item = &'static Declaration> + Clone {
            DECLARATIONS.iter().copied().flatten()
        }

        // The declarations of a law must agree with its loops.
        $(
            const _: () = {
                let mut k = 0;
                while k < <$law as Declared>::DECLARATIONS.len() {
                    assert!(<$law as Declared>::DECLARATIONS[k].linear == <$law as Law<3>>::LINEAR);
                    k += 1;
                }
            };
        )+
    };
}
pub(super) use register;
