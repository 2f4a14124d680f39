//! Tunables, each with a dotted name, a default, a range and a one-line meaning: the same names in
//! the scene file and in `set_number`.

use crate::error::{Error, Result};
use crate::system::build::BuildOptions;
use crate::system::yarn::contacts::Sliding;

macro_rules! settings {
    ($($(#[doc = $doc:literal])+ $field:ident: $name:literal = $default:expr, $min:expr, $max:expr, $unit:literal $($whole:ident)?;)*) => {
        /// Numbers that steer the solvers.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Settings {
            $($(#[doc = $doc])+ pub $field: f64,)*
        }

        impl Default for Settings {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl Settings {
            /// Every tunable.
            pub const KEYS: &'static [Key] = &[
                $(Key { name: $name, default: $default, min: $min, max: $max, unit: $unit,
                        whole: !concat!($(stringify!($whole),)?).is_empty(),
                        doc: concat!($($doc,)+) },)*
            ];

            /// Value by dotted name.
            pub fn get(&self, name: &str) -> Option<f64> {
                match name {
                    $($name => Some(self.$field),)*
                    _ => None,
                }
            }

            /// All that results depend on, by name.
            pub fn that_matter(&self) -> Vec<(String, f64)> {
                let all = [$(self.$field,)*];
                let pairs = Self::KEYS.iter().zip(all).filter(|(key, _)| key.matters());
                pairs.map(|(key, value)| (key.name.to_owned(), value)).collect()
            }

            /// Sets a value by dotted name; unknown names and values out of range are refused.
            pub fn set(&mut self, name: &str, value: f64) -> Result<()> {
                let Some(key) = Self::KEYS.iter().find(|k| k.name == name) else {
                    return Err(Error::argument(format!("'{name}' is not the name of a number; `toile schema` lists them")));
                };
                key.check(value)?;
                match name {
                    $($name => self.$field = value,)*
                    _ => {}
                }
                Ok(())
            }
        }
    };
}

/// One tunable as `toile schema` prints it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// Dotted name.
    pub name: &'static str,
    /// Value unless set.
    pub default: f64,
    /// Smallest admissible value.
    pub min: f64,
    /// Largest admissible value.
    pub max: f64,
    /// SI unit, or "1".
    pub unit: &'static str,
    /// Whether it is a whole number.
    pub whole: bool,
    /// Meaning.
    pub doc: &'static str,
}

/// Tunables on which no bit of a result depends.
const WITHOUT_EFFECT: [&str; 2] = ["solver.threads", "limits.vertices"];

impl Key {
    /// Whether results depend on it.
    pub fn matters(&self) -> bool {
        !WITHOUT_EFFECT.contains(&self.name)
    }

    /// Refuses a value out of range, and a fraction where a whole number is asked for.
    pub fn check(&self, value: f64) -> Result<()> {
        let Self { name, min, max, .. } = self;
        if !(*min..=*max).contains(&value) {
            return Err(Error::argument(format!(
                "{name} = {value} must lie in [{min}, {max}]"
            )));
        }
        if self.whole && value.fract() != 0.0 {
            return Err(Error::argument(format!(
                "{name} = {value} must be a whole number"
            )));
        }
        Ok(())
    }
}

settings! {
    /// Newton iterations allowed in one substep before it is cut.
    newton_max_iterations: "solver.newton.max_iterations" = 60.0, 1.0, 10_000.0, "1" whole;
    /// A substep has converged when the largest Newton correction, over the substep size, is below this speed.
    newton_velocity_tolerance: "solver.newton.velocity_tolerance" = 1e-3, 1e-12, 1e3, "m/s";
    /// A substep has also converged when the last Newton iteration has lowered the incremental potential by no more than this part of what all of them have. 0 asks for the velocity tolerance alone.
    newton_relative_tolerance: "solver.newton.relative_tolerance" = 0.0, 0.0, 0.5, "1";
    /// Smallest substep; below it a step gives up.
    min_step: "solver.step.min" = 1e-7, 1e-12, 1.0, "s";
    /// Largest substep.
    max_step: "solver.step.max" = 0.05, 1e-9, 10.0, "s";
    /// A drape is at rest when no free vertex carries a larger residual force.
    drape_force_tolerance: "solver.drape.force_tolerance" = 1e-5, 1e-14, 1e6, "N";
    /// Pseudo time steps allowed in a drape, on each level.
    drape_max_steps: "solver.drape.max_steps" = 2000.0, 1.0, 1e7, "1" whole;
    /// Coarse levels used by a drape from the flat panels, 0 for none.
    drape_levels: "solver.drape.levels" = 1.0, 0.0, 4.0, "1" whole;
    /// Linear solver: 0 chooses for each matrix, 1 sparse Cholesky, 2 conjugate gradients with block Jacobi, 3 with incomplete Cholesky, 4 with the Cholesky factor of an earlier matrix, 5 with those of overlapping parts, 6 conjugate gradients with block Jacobi and without the matrix, for memory and for motion: it is some hundred times as slow, and a drape does not prove that its rest is a minimum. With hybrid rings 0 and 1 are direct; 2 and 3 are conjugate gradients with diagonal blocks, 4 and 5 with factors of overlapping parts, both with the triangles as a second level; 6 counts as 2 there.
    linear_kind: "solver.linear.kind" = 0.0, 0.0, 6.0, "1" whole;
    /// Relative residual at which conjugate gradients stop.
    linear_tolerance: "solver.linear.tolerance" = 1e-3, 1e-14, 0.5, "1";
    /// Worker threads; results do not depend on it.
    threads: "solver.threads" = 1.0, 1.0, 256.0, "1" whole;
    /// Cloth against cloth contact: 1 on, 0 off.
    self_contact: "contact.self.enabled" = 1.0, 0.0, 1.0, "1" whole;
    /// Stiffness of cloth against cloth, pressure per depth.
    self_stiffness: "contact.self.stiffness" = 1e6, 0.0, 1e12, "Pa/m";
    /// Stiffness of the seam springs per length of seam.
    seam_stiffness: "seam.stiffness" = 2e5, 1.0, 1e12, "N/m^2";
    /// Largest force with which an open seam is pulled together, per length of seam.
    seam_pull: "seam.pull" = 50.0, 1e-3, 1e6, "N/m";
    /// Where yarns may slide through contacts: 0 nowhere, 1 where friction does not hold them, 2 everywhere, friction being a stiff spring where it holds.
    yarn_sliding: "yarn.sliding" = 1.0, 0.0, 2.0, "1" whole;
    /// A substep of yarns has also converged when the last full Newton correction is no more than this part of the substep's displacement, both as root mean squares weighted by mass. 0 asks for the velocity tolerance alone.
    yarn_relative_velocity: "yarn.relative_velocity" = 1e-3, 0.0, 0.5, "1";
    /// Inertia forces of yarn that slides: 1 on, 0 off.
    yarn_inertia: "yarn.inertia_forces" = 1.0, 0.0, 1.0, "1" whole;
    /// In hybrid rings, whether the mean displacement of the nodes beside each triangle is held at zero: 1 yes, 0 no. Taken when yarns come in.
    blend_means: "blend.means" = 0.0, 0.0, 1.0, "1" whole;
    /// Whether yarns are enriched by triangles where they are alone too, which changes nothing but the work: 1 yes, for tests, 0 no. Taken when yarns come in.
    blend_enrich: "blend.enrich_everywhere" = 0.0, 0.0, 1.0, "1" whole;
    /// Quadratic drag of the air along the normal, times density of air.
    air_drag: "air.drag" = 1.2, 0.0, 1e3, "kg/m^3";
    /// Tangential drag (skin friction) of the air, times density of air.
    air_lift: "air.tangential" = 0.06, 0.0, 1e3, "kg/m^3";
    /// Largest number of vertices that a garment may have.
    max_vertices: "limits.vertices" = 2e6, 3.0, 1e8, "1" whole;
    /// Largest number of yarn nodes that a garment may have.
    max_yarn_nodes: "limits.yarn_nodes" = 5e6, 1.0, 1e8, "1" whole;
}

impl From<&Settings> for BuildOptions {
    fn from(s: &Settings) -> Self {
        Self {
            softening: 1.0,
            seam_stiffness: s.seam_stiffness,
            seam_pull: s.seam_pull,
            air_drag: s.air_drag,
            air_tangential: s.air_lift,
            self_contact: s.self_contact > 0.5,
            self_stiffness: s.self_stiffness,
            sliding: match s.yarn_sliding as u32 {
                0 => Sliding::Nowhere,
                1 => Sliding::WhereSlipping,
                _ => Sliding::Everywhere,
            },
            inertia_forces: s.yarn_inertia > 0.5,
        }
    }
}
