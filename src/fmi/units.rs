//! Units of the variables in base units of the SI.

/// A unit: name, exponents of kilogram, metre, second and radian.
pub(super) type Unit = (&'static str, i32, i32, i32, i32);

/// Every unit that a variable may name.
pub(super) const UNITS: &[Unit] = &[
    ("s", 0, 0, 1, 0),
    ("1/s", 0, 0, -1, 0),
    ("m", 0, 1, 0, 0),
    ("m/s", 0, 1, -1, 0),
    ("rad/s", 0, 0, -1, 1),
    ("m/s^2", 0, 1, -2, 0),
    ("N", 1, 1, -2, 0),
    ("N/m", 1, 0, -2, 0),
    ("N/m^2", 1, -1, -2, 0),
    ("N.m", 1, 2, -2, 0),
    ("J", 1, 2, -2, 0),
    ("Pa", 1, -1, -2, 0),
    ("Pa/m", 1, -2, -2, 0),
    ("kg/m^2", 1, -2, 0, 0),
    ("kg/m^3", 1, -3, 0, 0),
];

/// The table's own text for a unit of `Settings`; "1" is no unit.
pub(super) fn named(unit: &str) -> &'static str {
    UNITS.iter().find(|u| u.0 == unit).map_or("", |u| u.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::settings::Settings;

    #[test]
    fn every_unit_of_the_settings_is_known() {
        for key in Settings::KEYS {
            assert!(
                key.unit == "1" || named(key.unit) == key.unit,
                "{}",
                key.name
            );
        }
    }
}
