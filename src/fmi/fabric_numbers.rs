//! The numbers of a fabric that are parameters of an FMU, with unit, range and place.

use crate::pattern::Fabric;

macro_rules! numbers {
    ($($variant:ident $name:literal $field:ident $unit:literal $min:expr, $doc:literal;)*) => {
        /// A number of a fabric.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum FabricNumber {
            $(#[doc = $doc] $variant,)*
        }

        impl FabricNumber {
            /// All of them, in the order of the variables.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Name below the fabric's: the key of the fabric's file.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Unit, "" for none.
            pub fn unit(self) -> &'static str {
                match self { $(Self::$variant => $unit,)* }
            }

            /// Smallest admissible value.
            pub fn min(self) -> Option<f64> {
                match self { $(Self::$variant => $min,)* }
            }

            /// Meaning.
            pub fn doc(self) -> &'static str {
                match self { $(Self::$variant => $doc,)* }
            }

            /// Its value in a fabric.
            pub fn of(self, fabric: &Fabric) -> f64 {
                match self { $(Self::$variant => fabric.$field,)* }
            }

            /// Its place in a fabric.
            pub fn slot(self, fabric: &mut Fabric) -> &mut f64 {
                match self { $(Self::$variant => &mut fabric.$field,)* }
            }
        }
    };
}

impl FabricNumber {
    /// Whether a fit to yarns decides it.
    pub fn is_fitted(self) -> bool {
        !matches!(
            self,
            Self::DampingMass | Self::DampingStiffness | Self::Thickness | Self::Friction
        )
    }
}

numbers! {
    Density "density" density "kg/m^2" Some(1e-6), "mass per area";
    Warp "membrane.warp" warp "N/m" Some(1e-9), "stiffness along the warp";
    Weft "membrane.weft" weft "N/m" Some(1e-9), "stiffness along the weft";
    Coupling "membrane.coupling" coupling "N/m" None, "coupling between warp and weft";
    Shear "membrane.shear" shear "N/m" Some(1e-9), "shear stiffness";
    BendingWarp "bending.warp" bending_warp "N.m" Some(0.0), "bending stiffness that resists curving the warp";
    BendingWeft "bending.weft" bending_weft "N.m" Some(0.0), "bending stiffness that resists curving the weft";
    DampingMass "damping.mass" damping_mass "1/s" Some(0.0), "damping proportional to mass";
    DampingStiffness "damping.stiffness" damping_stiffness "s" Some(0.0), "damping proportional to stiffness";
    Thickness "thickness" thickness "m" Some(0.0), "thickness, half of it kept free on each side in contacts";
    Friction "friction" friction "" Some(0.0), "Coulomb friction of cloth on cloth";
}
