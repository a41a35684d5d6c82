//! Macro that generates code from the list of laws: the enums, the dispatch to each law, and all
//! declarations.

/// Generate, from the list of laws, the enums of laws and the macros that dispatch to a law. The first
/// argument is the token `$`, which the generated macros contain.
macro_rules! register {
    ($d:tt $($file:ident :: $law:ident),+ $(,)?) => {
        $(pub use $file::$law;)+

        /// Any of the laws.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[expect(clippy::large_enum_variant, reason = "there is one per body, not one per point")]
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

        /// The two laws of a bond: the laws of points i and j.
        #[derive(Debug, Clone, Copy)]
        pub enum PairLaw {
            $($law([$law; 2]),)+
            /// Points i and j have different laws.
            Mixed([AnyLaw; 2]),
        }

        impl PairLaw {
            /// Create the pair from the laws of points i and j.
            pub fn new(here: AnyLaw, there: AnyLaw) -> Self {
                match (here, there) {
                    $((AnyLaw::$law(here), AnyLaw::$law(there)) => Self::$law([here, there]),)+
                    _ => Self::Mixed([here, there]),
                }
            }

            /// Return the laws of points i and j.
            pub fn laws(&self) -> [AnyLaw; 2] {
                match *self {
                    $(Self::$law([i, j]) => [i.into(), j.into()],)+
                    Self::Mixed(laws) => laws,
                }
            }
        }

        /// Evaluate an expression in which a name stands for the law in an [`AnyLaw`]. The expression is
        /// compiled once per law.
        macro_rules! with_law {
            ($d any:expr, $d law_name:ident => $d body:expr) => {
                match $d any {
                    $($crate::material::AnyLaw::$law($d law_name) => $d body,)+
                }
            };
        }
        pub(crate) use with_law;

        /// Evaluate an expression in which a name stands for the two laws in a [`PairLaw`]. The expression is
        /// compiled once for each law, for bonds between points with this law. It is compiled once more for
        /// bonds between points with different laws.
        macro_rules! with_pair {
            ($d pair:expr, $d laws:ident => $d body:expr) => {
                match $d pair {
                    $($crate::material::PairLaw::$law($d laws) => $d body,)+
                    $crate::material::PairLaw::Mixed($d laws) => $d body,
                }
            };
        }
        pub(crate) use with_pair;

        /// Sizes of the data of each law in three dimensions.
        const COUNTS: &[Counts] = &[$(Counts::of::<$law, 3>()),+];

        const DECLARATIONS: &[&[Declaration]] = &[$(<$law as Declared>::DECLARATIONS),+];

        /// Return the declarations of all laws.
        pub fn declarations() -> impl Iterator<Item = &'static Declaration> + Clone {
            DECLARATIONS.iter().copied().flatten()
        }

        // `Declaration::linear` and `Declaration::wears_out` must agree with `Law::LINEAR` and
        // `Law::WEARS_OUT`.
        $(
            const _: () = {
                let mut k = 0;
                while k < <$law as Declared>::DECLARATIONS.len() {
                    let declared = &<$law as Declared>::DECLARATIONS[k];
                    assert!(declared.linear == <$law as Law<3>>::LINEAR);
                    assert!(declared.wears_out == <$law as Law<3>>::WEARS_OUT);
                    k += 1;
                }
            };
        )+
    };
}
pub(super) use register;
