//! Names that FMI's structured convention and C identifiers admit, made from names for people.

use std::collections::BTreeSet;

/// Letters, digits and underscores, not beginning with a digit; never empty.
pub(super) fn identifier(name: &str) -> String {
    let mut out: String = name
        .trim()
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
        .collect();
    if out.is_empty() || out.starts_with(|c: char| c.is_ascii_digit()) {
        out.insert(0, '_');
    }
    out
}

/// Identifiers for a list of names, made unique by numbers: the second `ball` is `ball_2`.
pub(super) fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut taken = BTreeSet::new();
    names
        .map(|name| {
            let base = identifier(name);
            let mut own = base.clone();
            let mut k = 2;
            while !taken.insert(own.clone()) {
                own = format!("{base}_{k}");
                k += 1;
            }
            own
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_identifiers_and_no_two_are_alike() {
        let made = unique(["cotton lawn", "cotton-lawn", "", "3 ply", "ärmel"].into_iter());
        assert_eq!(
            made,
            ["cotton_lawn", "cotton_lawn_2", "_", "_3_ply", "_rmel"]
        );
    }
}
