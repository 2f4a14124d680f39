//! Colours of pictures and model files, sRGB from 0 to 1.
//!
//! Panel colours are muted and of nearly equal lightness, so that shading, not hue, tells shape;
//! neighbours in the list differ clearly in hue, because neighbouring panels usually stand next to
//! each other in the file.

/// Skin of a body: a warm neutral grey that competes with no panel.
pub const BODY: [f32; 3] = [0.70, 0.665, 0.64];
/// Background at the top of a picture.
pub const SKY: [f32; 3] = [0.93, 0.94, 0.95];
/// Background at the bottom of a picture.
pub const FLOOR: [f32; 3] = [0.80, 0.81, 0.82];
/// Lines: panel borders, seams, outlines.
pub const INK: [f32; 3] = [0.13, 0.14, 0.18];

const PANELS: [[f32; 3]; 10] = [
    [0.33, 0.50, 0.66],
    [0.80, 0.52, 0.38],
    [0.45, 0.62, 0.49],
    [0.83, 0.68, 0.40],
    [0.56, 0.47, 0.64],
    [0.38, 0.62, 0.64],
    [0.76, 0.46, 0.50],
    [0.62, 0.64, 0.40],
    [0.48, 0.53, 0.74],
    [0.70, 0.58, 0.50],
];

/// Colour of a panel by its number; the list repeats.
pub fn panel(index: u32) -> [f32; 3] {
    PANELS[index as usize % PANELS.len()]
}

const HEAT: [[f32; 3]; 4] = [
    [0.88, 0.88, 0.86],
    [0.93, 0.78, 0.48],
    [0.83, 0.38, 0.25],
    [0.42, 0.08, 0.20],
];

/// Colour of an amount from 0, pale, to 1, dark red.
pub fn heat(amount: f64) -> [f32; 3] {
    let last = HEAT.len() - 1;
    let at = amount.clamp(0.0, 1.0) as f32 * last as f32;
    let low = (at as usize).min(last - 1);
    let part = at - low as f32;
    [0, 1, 2].map(|c| HEAT[low][c] * (1.0 - part) + HEAT[low + 1][c] * part)
}

/// One sRGB channel to linear light (IEC 61966-2-1).
pub fn to_linear(c: f32) -> f32 {
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear light to one sRGB channel (IEC 61966-2-1).
pub fn to_srgb(c: f32) -> f32 {
    if c <= 0.003_130_8 {
        12.92 * c
    } else {
        1.055 * c.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_and_linear_light_are_inverse() {
        for i in 0..=255 {
            let c = i as f32 / 255.0;
            assert!((to_srgb(to_linear(c)) - c).abs() < 1e-4, "{c}");
        }
    }
}
