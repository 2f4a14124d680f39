//! What a fabric is made of when every yarn is simulated: how the yarns interlace and what a yarn is.
//!
//! Numbers that are not given follow from the others:
//!
//! | number | default | source |
//! |---|---|---|
//! | mass per length | `0.5 * 1500 kg/m^3 * pi R^2` | cotton or wool fibres, half of the yarn's section |
//! | stitch wrapping `k_w` | `B` | the published 1e-2 N rolls every knit up; `k_w = B` curls like cloth |
//! | stitch length `k_l` | `Y pi R^2` | no published value; as stiff as the yarn itself |
//! | least spacing `k_c` | `0.1 Y pi R^2 / (2 R pitch)` | across a yarn is a tenth as stiff as along it |
//! | loop height | 0.85 loop width | proportion of relaxed jersey |
//!
//! Loop width, radius, `Y`, `B`, friction and Rayleigh damping of the knitted presets are those of
//! Cirio et al. 2017, table 1. The woven presets are shirtings of 20 yarns to the centimetre with a
//! radius of a quarter of the pitch (37 tex, 150 g/m^2).

use super::chart::{Chart, Stitch};
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// Longest side of a weave's repeat.
const MAX_REPEAT: usize = 1000;
/// Least loop height over loop width: below it, the contacts of neighbouring courses overlap.
const LEAST_HEIGHT: f64 = 0.4;
/// Stiffness of a yarn across over that along.
const ACROSS: f64 = 0.1;
/// Relative slack of the checks of spacing: numbers such as 0.003 and 4 * 0.00075 must agree.
const SLACK: f64 = 1e-9;
/// Thinnest and thickest yarn [m].
const RADII: [f64; 2] = [1e-6, 0.1];
/// Largest of any other number: a stiffness of diamond in Pa.
const LARGEST: f64 = 1e12;

/// Which yarn lies in front at the crossings of a weave's repeat.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    width: usize,
    over: Vec<bool>,
}

/// Warp and weft.
#[derive(Clone, Debug, PartialEq)]
pub struct Weave {
    /// Where the warp lies in front.
    pub mask: Mask,
    /// From one warp yarn to the next [m].
    pub warp_pitch: f64,
    /// From one weft yarn to the next [m].
    pub weft_pitch: f64,
}

/// Loops.
#[derive(Clone, Debug, PartialEq)]
pub struct Knit {
    /// The stitches.
    pub chart: Chart,
    /// The chart is the whole piece, not a repeat.
    pub once: bool,
    /// From one loop to the next along a course [m].
    pub loop_width: f64,
    /// From one course to the next [m].
    pub loop_height: f64,
}

/// How the yarns interlace.
#[derive(Clone, Debug, PartialEq)]
pub enum Structure {
    /// Warp and weft.
    Woven(Weave),
    /// Loops.
    Knitted(Knit),
}

/// A fabric of yarns. All yarns of it are alike.
#[derive(Clone, Debug, PartialEq)]
pub struct YarnFabric {
    /// How the yarns interlace.
    pub structure: Structure,
    /// Radius `R` of a yarn [m].
    pub radius: f64,
    /// Mass per length of yarn [kg/m].
    pub density: f64,
    /// Young's modulus `Y` [Pa].
    pub young: f64,
    /// Bending modulus `B` [N]; the flexural rigidity is `B pi R^2`.
    pub bending: f64,
    /// Shear modulus `S` of crossings [Pa].
    pub shear: f64,
    /// Stitch wrapping `k_w` [N].
    pub wrapping: f64,
    /// Length inside of stitch contacts `k_l` [N].
    pub stitch: f64,
    /// Least distance of crossings `k_c` [N/m^2].
    pub spacing: f64,
    /// Coulomb friction between yarns.
    pub friction: f64,
    /// Stiffness of the friction's anchors `k_f` [N/m].
    pub anchor: f64,
    /// Viscous resistance to sliding [N s/m].
    pub sliding_damping: f64,
    /// Mass-proportional damping [1/s].
    pub damping_mass: f64,
    /// Stiffness-proportional damping [s].
    pub damping_stiffness: f64,
    /// Whether it is laid with the distances of yarns at which it is at rest.
    pub compensated: bool,
    /// Whether the ends of a knitted piece's yarn are woven in: it does not slide at its last contacts. Ends at which it
    /// has been cut are free.
    pub fastened: bool,
}

/// Weaves known by name.
pub const WEAVES: &[&str] = &["plain", "twill 2/2", "twill 3/1", "satin 5"];

/// Fabrics known by name, with what they are.
pub const PRESETS: &[(&str, &str)] = &[
    ("plain shirting", "plain weave, pitch 0.5 mm"),
    ("twill shirting", "twill 2/2, pitch 0.5 mm"),
    ("satin shirting", "satin 5, pitch 0.5 mm"),
    ("sweater", "garter, loops of 3 mm"),
    ("shirt", "garter, loops of 1 mm"),
    ("pullover", "stockinette, loops of 6 mm"),
    ("jersey", "stockinette, the sweater's yarn"),
    ("rib", "rib 2x2, the sweater's yarn"),
];

impl Mask {
    /// One of [`WEAVES`].
    pub fn preset(name: &str) -> Option<Self> {
        // warp i, weft j
        let rule: (usize, fn(usize, usize) -> bool) = match name {
            "plain" => (2, |i, j| (i + j) % 2 == 0),
            "twill 2/2" => (4, |i, j| (i + j) % 4 < 2),
            "twill 3/1" => (4, |i, j| (i + j) % 4 < 3),
            "satin 5" => (5, |i, j| (2 * i + j) % 5 == 0),
            _ => return None,
        };
        let (width, over) = rule;
        Some(Self {
            width,
            over: (0..width * width)
                .map(|k| over(k % width, k / width))
                .collect(),
        })
    }

    /// From lines, the first weft first: `x` where the warp lies in front, `.` where the weft does.
    pub fn from_lines(lines: &[&str]) -> Result<Self> {
        let refuse = |row: usize, column: usize, text: String| {
            Error::parse(format!("row {row} column {column}: {text}"))
        };
        let width = lines.first().map_or(0, |line| line.chars().count());
        if width == 0 {
            return Err(refuse(1, 1, "the weave has no crossings".into()));
        }
        if lines.len() > MAX_REPEAT || width > MAX_REPEAT {
            return Err(Error::limit(format!(
                "weave of {} x {width} crossings, limit {MAX_REPEAT} x {MAX_REPEAT}",
                lines.len()
            )));
        }
        let mut over = Vec::with_capacity(width * lines.len());
        for (j, line) in lines.iter().enumerate() {
            let count = line.chars().count();
            if count != width {
                let text = format!("{count} crossings, row 1 has {width}");
                return Err(refuse(j + 1, count.min(width) + 1, text));
            }
            for (i, sign) in line.chars().enumerate() {
                over.push(match sign {
                    'x' => true,
                    '.' => false,
                    other => {
                        let text = format!("{other:?} must be 'x' (warp in front) or '.'");
                        return Err(refuse(j + 1, i + 1, text));
                    }
                });
            }
        }
        let mask = Self { width, over };
        mask.check_interlaced()?;
        Ok(mask)
    }

    /// Refuses a yarn that never changes sides: nothing holds it.
    fn check_interlaced(&self) -> Result<()> {
        let [width, height] = self.size();
        let side = |front: bool| if front { "in front of" } else { "behind" };
        for j in 0..height {
            let first = self.warp_over(0, j);
            if (1..width).all(|i| self.warp_over(i, j) == first) {
                return Err(Error::parse(format!(
                    "row {}: weft {} lies {} all warp yarns and is held by none",
                    j + 1,
                    j + 1,
                    side(!first)
                )));
            }
        }
        for i in 0..width {
            let first = self.warp_over(i, 0);
            if (1..height).all(|j| self.warp_over(i, j) == first) {
                return Err(Error::parse(format!(
                    "column {}: warp {} lies {} all weft yarns and is held by none",
                    i + 1,
                    i + 1,
                    side(first)
                )));
            }
        }
        Ok(())
    }

    /// Its name, or its lines.
    pub fn lines(&self) -> std::result::Result<&'static str, Vec<String>> {
        if let Some(name) = WEAVES
            .iter()
            .find(|n| Self::preset(n).as_ref() == Some(self))
        {
            return Ok(name);
        }
        let sign = |over: &bool| if *over { 'x' } else { '.' };
        let line = |row: &[bool]| row.iter().map(sign).collect();
        Err(self.over.chunks(self.width).map(line).collect())
    }

    /// Warp and weft yarns of the repeat.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.over.len() / self.width]
    }

    /// Whether warp `i` lies in front of weft `j`.
    pub fn warp_over(&self, i: usize, j: usize) -> bool {
        let height = self.over.len() / self.width;
        self.over[(j % height) * self.width + i % self.width]
    }
}

impl Structure {
    /// Distances of neighbouring yarns or loops across and along [m].
    pub fn pitch(&self) -> [f64; 2] {
        match self {
            Self::Woven(weave) => [weave.warp_pitch, weave.weft_pitch],
            Self::Knitted(knit) => [knit.loop_width, knit.loop_height],
        }
    }

    /// Yarns or loops across, wefts or courses along, after which the fabric repeats; of a knit the fewest.
    pub fn repeat(&self) -> [usize; 2] {
        match self {
            Self::Woven(weave) => weave.mask.size(),
            Self::Knitted(knit) => {
                let rows = knit.chart.resolved(true);
                let loops = |row: &Vec<_>| row.iter().map(Stitch::makes).sum::<usize>();
                let across = if knit.chart.is_plain() {
                    // rows may be of several lengths: each has its own period
                    let periods = rows.iter().map(|row| period(row));
                    periods.fold(1, |all, p| all / common(all, p) * p)
                } else {
                    rows.iter().map(loops).max().unwrap_or(1)
                };
                [across, period(&rows)]
            }
        }
    }
}

/// Fewest items after which a list goes on as it began.
fn period<T: PartialEq>(items: &[T]) -> usize {
    let n = items.len();
    let repeats = |p: &usize| {
        n.is_multiple_of(*p)
            && items[*p..]
                .iter()
                .zip(items)
                .all(|(item, first)| item == first)
    };
    (1..=n).find(repeats).unwrap_or(1)
}

/// Greatest common divisor (Euclid).
fn common(a: usize, b: usize) -> usize {
    if b == 0 { a } else { common(b, a % b) }
}

impl YarnFabric {
    /// A fabric of cotton yarn with this radius [m].
    pub fn new(structure: Structure, radius: f64) -> Self {
        let mut fabric = Self {
            structure,
            radius,
            density: 0.0,
            young: 1e7,
            bending: 3e-4,
            shear: 1e3,
            wrapping: 0.0,
            stitch: 0.0,
            spacing: 0.0,
            friction: 0.3,
            anchor: 1e3,
            sliding_damping: 0.01,
            damping_mass: 2.0,
            damping_stiffness: 0.01,
            compensated: false,
            fastened: true,
        };
        fabric.derive();
        fabric
    }

    /// Sets the numbers that follow from others to their defaults.
    pub fn derive(&mut self) {
        let section = PI * self.radius * self.radius;
        let [a, b] = self.structure.pitch();
        self.density = 0.5 * 1500.0 * section;
        self.wrapping = self.bending;
        self.stitch = self.young * section;
        self.spacing = ACROSS * self.young * section / (2.0 * self.radius * a.min(b));
    }

    /// One of [`PRESETS`].
    pub fn preset(name: &str) -> Result<Self> {
        let unknown = || {
            let known: Vec<&str> = PRESETS.iter().map(|(known, _)| *known).collect();
            Error::parse(format!(
                "unknown fabric of yarns {name:?}; known are {}",
                known.join(", ")
            ))
        };
        let weave = |mask: &str| -> Result<Structure> {
            Ok(Structure::Woven(Weave {
                mask: Mask::preset(mask).ok_or_else(unknown)?,
                warp_pitch: 5e-4,
                weft_pitch: 5e-4,
            }))
        };
        let knit = |chart: &str, loop_width: f64| -> Result<Structure> {
            Ok(Structure::Knitted(Knit {
                chart: Chart::preset(chart)?,
                once: false,
                loop_width,
                loop_height: 0.85 * loop_width,
            }))
        };
        // structure, radius, B, Rayleigh damping
        let (structure, radius, bending, damping) = match name {
            "plain shirting" => (weave("plain")?, 1.25e-4, 3e-4, (2.0, 0.01)),
            "twill shirting" => (weave("twill 2/2")?, 1.25e-4, 3e-4, (2.0, 0.01)),
            "satin shirting" => (weave("satin 5")?, 1.25e-4, 3e-4, (2.0, 0.01)),
            "sweater" => (knit("garter", 3e-3)?, 7.5e-4, 1e-3, (10.0, 0.01)),
            "shirt" => (knit("garter", 1e-3)?, 2.5e-4, 3e-4, (2.0, 0.1)),
            "pullover" => (knit("stockinette", 6e-3)?, 1.5e-3, 3e-4, (5.0, 0.01)),
            "jersey" => (knit("stockinette", 3e-3)?, 7.5e-4, 1e-3, (10.0, 0.01)),
            "rib" => (knit("rib 2x2", 3e-3)?, 7.5e-4, 1e-3, (10.0, 0.01)),
            _ => return Err(unknown()),
        };
        let mut fabric = Self::new(structure, radius);
        fabric.bending = bending;
        (fabric.damping_mass, fabric.damping_stiffness) = damping;
        fabric.derive();
        Ok(fabric)
    }

    /// Refuses numbers that are not finite, signs that cannot be, and yarns that do not fit beside
    /// each other.
    pub fn check(&self) -> Result<()> {
        let refuse = |key: &str, value: f64, rule: &str| {
            Err(Error::material(format!(
                "yarns.{key} = {value} must be {rule}"
            )))
        };
        let [a, b] = self.structure.pitch();
        let names = match self.structure {
            Structure::Woven(_) => ["warp_pitch", "weft_pitch"],
            Structure::Knitted(_) => ["loop_width", "loop_height"],
        };
        let positive = [
            ("radius", self.radius),
            (names[0], a),
            (names[1], b),
            ("density", self.density),
            ("young", self.young),
            ("bending", self.bending),
            ("stitch", self.stitch),
            ("anchor", self.anchor),
        ];
        let not_negative = [
            ("shear", self.shear),
            ("wrapping", self.wrapping),
            ("spacing", self.spacing),
            ("friction", self.friction),
            ("sliding_damping", self.sliding_damping),
            ("damping.mass", self.damping_mass),
            ("damping.stiffness", self.damping_stiffness),
        ];
        for (key, value) in positive {
            if !value.is_finite() || value <= 0.0 {
                return refuse(key, value, "finite and positive");
            }
        }
        let [thin, thick] = RADII;
        if !(thin..=thick).contains(&self.radius) {
            let rule = format!("at least {thin} m, a fibre, and at most {thick} m, a hawser");
            return refuse("radius", self.radius, &rule);
        }
        for (key, value) in positive.iter().chain(&not_negative) {
            if *value > LARGEST {
                let rule = format!("at most {LARGEST:e}: no material comes near it");
                return refuse(key, *value, &rule);
            }
        }
        for (key, value) in not_negative {
            if !value.is_finite() || value < 0.0 {
                return refuse(key, value, "finite and not negative");
            }
        }
        let fit = |key: &str, value: f64, least: f64, reason: &str| {
            if value >= least * (1.0 - SLACK) {
                return Ok(());
            }
            refuse(key, value, &format!("at least {least} m: {reason}"))
        };
        let r = self.radius;
        match &self.structure {
            Structure::Woven(_) => {
                let reason = "two radii, or neighbouring yarns lie in each other";
                fit(names[0], a, 2.0 * r, reason)?;
                fit(names[1], b, 2.0 * r, reason)
            }
            Structure::Knitted(knit) => {
                let reason = "four radii, or the two legs of a loop have no room";
                fit(names[0], a, 4.0 * r, reason)?;
                let reason = "two radii, or neighbouring courses lie in each other";
                fit(names[1], b, 2.0 * r, reason)?;
                let reason = "0.4 loop widths, or the contacts of neighbouring courses overlap";
                fit(names[1], b, LEAST_HEIGHT * a, reason)?;
                if !knit.once {
                    knit.chart.check_repeat().map_err(|e| e.at("yarns"))?;
                } else if self.compensated {
                    return Err(Error::material(
                        "yarns.compensated: a chart that is the whole piece has no repeat to bring to rest",
                    ));
                }
                Ok(())
            }
        }
    }
}
