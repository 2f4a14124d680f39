//! Pictures of a garment on its bodies: a small software renderer, PNG out.
//!
//! One picture shows the front, the side and the back beside each other. Stages: soft light for
//! every vertex by depth maps from many directions (`light`), perspective cameras fitted to the
//! garment (`camera`), planes without end (`backdrop`), depth-buffered triangles at twice the resolution (`raster`), shading and
//! lines (`shade`), box filter down to pixels. No axis but `up` is special: the front is seen from
//! `front`, as GarmentCode bodies face +Z.

mod backdrop;
mod camera;
mod light;
mod raster;
mod shade;

use super::{Part, palette, surface};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::parallel::Workers;
use camera::{Camera, Frame};

/// How to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureOptions {
    /// Width [pixel].
    pub width: usize,
    /// Height [pixel].
    pub height: usize,
    /// Directions from which the scene is seen, about the up axis [rad]; 0 is the front.
    pub views: Vec<f64>,
    /// Unit vector up.
    pub up: Vec3,
    /// Unit vector from the scene to the eye of the front view; orthogonal to `up`.
    pub front: Vec3,
    /// Height of the ground along `up` [m] that catches shadows; `None` puts it under the scene,
    /// or on the floor if there is one.
    pub ground: Option<f64>,
    /// Threads to draw with; the picture does not depend on it.
    pub threads: usize,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self {
            width: 1200,
            height: 900,
            views: vec![0.0, std::f64::consts::FRAC_PI_2, std::f64::consts::PI],
            up: Vec3::y(),
            front: Vec3::z(),
            ground: None,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
        }
    }
}

/// A finished picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width [pixel].
    pub width: usize,
    /// Height [pixel].
    pub height: usize,
    /// Rows from the top, three bytes a pixel.
    pub rgb: Vec<u8>,
}

impl Picture {
    /// Writes a PNG file.
    pub fn write_png(&self, path: &std::path::Path) -> Result<()> {
        let fail = |e: &dyn std::fmt::Display| Error::io(format!("{}: {e}", path.display()));
        let file = std::fs::File::create(path).map_err(|e| fail(&e))?;
        self.encode(std::io::BufWriter::new(file))
            .map_err(|e| e.at(path.display()))
    }

    /// The bytes of a PNG file.
    pub fn to_png(&self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.encode(&mut bytes)?;
        Ok(bytes)
    }

    fn encode(&self, out: impl std::io::Write) -> Result<()> {
        let fail = |e: &dyn std::fmt::Display| Error::io(e.to_string());
        let size = |n: usize| u32::try_from(n).map_err(|e| fail(&e));
        let mut encoder = png::Encoder::new(out, size(self.width)?, size(self.height)?);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(|e| fail(&e))?;
        writer.write_image_data(&self.rgb).map_err(|e| fail(&e))?;
        writer.finish().map_err(|e| fail(&e))
    }
}

/// Subpixels along each side of a pixel.
const SUB: usize = 2;

/// All parts as one mesh with what shading needs at its vertices.
pub(crate) struct Scene {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) colours: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Whether a triangle is cloth.
    pub(crate) cloth: Vec<bool>,
    /// Whether a triangle is seen from its outer side only.
    pub(crate) one_sided: Vec<bool>,
    pub(crate) lines: Vec<[u32; 2]>,
}

impl Scene {
    fn new(parts: &[(Part, bool)]) -> Result<Self> {
        let mut s = Self {
            positions: Vec::new(),
            normals: Vec::new(),
            colours: Vec::new(),
            triangles: Vec::new(),
            cloth: Vec::new(),
            one_sided: Vec::new(),
            lines: Vec::new(),
        };
        for (part, one_sided) in parts {
            let base = s.positions.len();
            if base + part.positions.len() > u32::MAX as usize {
                return Err(Error::limit("more than 2^32 vertices in a picture"));
            }
            let base = base as u32;
            s.positions.extend(&part.positions);
            s.normals
                .extend(surface::normals(&part.positions, &part.triangles));
            s.colours
                .extend(part.colours.iter().map(|c| c.map(palette::to_linear)));
            s.triangles
                .extend(part.triangles.iter().map(|t| t.map(|i| i + base)));
            s.cloth
                .extend(std::iter::repeat_n(part.cloth, part.triangles.len()));
            s.one_sided
                .extend(std::iter::repeat_n(*one_sided, part.triangles.len()));
            s.lines
                .extend(part.lines.iter().map(|l| l.map(|i| i + base)));
        }
        Ok(s)
    }
}

/// Draws the parts.
pub fn render(parts: &[Part], options: &PictureOptions) -> Result<Picture> {
    let (width, height) = (options.width, options.height);
    if width == 0 || height == 0 || width.saturating_mul(height) > 64_000_000 {
        return Err(Error::argument(format!(
            "picture of {width} x {height} pixels must have 1 to 64 million"
        )));
    }
    let up = options
        .up
        .try_normalize(1e-12)
        .ok_or_else(|| Error::argument("picture: `up` has no direction"))?;
    let front = (options.front - up * options.front.dot(&up))
        .try_normalize(1e-12)
        .ok_or_else(|| Error::argument("picture: `front` is parallel to `up`"))?;
    let workers = Workers::new(options.threads.min(64));
    for part in parts {
        part.check()?;
    }
    let frame = Frame::of(parts, &up, &front);
    let (parts, ground) = backdrop::arrange(parts, &frame);
    let scene = Scene::new(&parts)?;
    let ground = options.ground.unwrap_or(ground);
    let floor = light::Floor::new(&frame, ground);
    let lit = light::Light::new(&scene, &floor, &frame, &options.views, &workers);
    let mut canvas = shade::Canvas::new(width * SUB, height * SUB);
    let cameras = Camera::fit_all(&frame, &options.views, width * SUB, height * SUB);
    for (camera, lamp) in cameras.iter().zip(&lit.lamps) {
        canvas.draw(&scene, &floor, &lit, lamp, camera, &workers);
    }
    Ok(canvas.resolve(SUB))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball() -> Part {
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        let (n, m) = (24_u32, 48_u32);
        for i in 0..=n {
            for j in 0..m {
                let a = std::f64::consts::PI * f64::from(i) / f64::from(n);
                let b = std::f64::consts::TAU * f64::from(j) / f64::from(m);
                positions.push(Vec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin()) * 0.5);
                if i < n {
                    let k = |i: u32, j: u32| i * m + j % m;
                    triangles.push([k(i, j), k(i, j + 1), k(i + 1, j)]);
                    triangles.push([k(i, j + 1), k(i + 1, j + 1), k(i + 1, j)]);
                }
            }
        }
        Part {
            cloth: true,
            ..Part::body("ball", positions, triangles)
        }
    }

    fn small() -> PictureOptions {
        PictureOptions {
            width: 240,
            height: 120,
            ..PictureOptions::default()
        }
    }

    #[test]
    fn a_ball_is_round_lit_from_above_and_alike_from_every_side() {
        let picture = render(&[ball()], &small()).unwrap();
        let empty = render(&[], &small()).unwrap();
        let grey = |p: &Picture, x: usize, y: usize| {
            let i = 3 * (y * p.width + x);
            i32::from(p.rgb[i]) + i32::from(p.rgb[i + 1]) + i32::from(p.rgb[i + 2])
        };
        let covered = |x: usize, y: usize| (grey(&picture, x, y) - grey(&empty, x, y)).abs() > 40;
        // three equal columns, each with its ball in the middle
        for column in 0..3 {
            let cx = 40 + 80 * column;
            let row: Vec<usize> = (0..80).filter(|i| covered(cx - 40 + i, 58)).collect();
            let (left, right) = (row[0], row[row.len() - 1]);
            assert!((left + right).abs_diff(80) <= 3, "{left} {right}");
            assert!(
                right - left > 30,
                "the ball fills its column: {left} {right}"
            );
            let top = (0..120).find(|&y| covered(cx, y)).unwrap();
            assert!(
                grey(&picture, cx, top + 10) > grey(&picture, cx, 58 + (58 - top) - 6),
                "light comes from above"
            );
        }
    }

    #[test]
    fn same_picture_twice_and_bad_input_refused() {
        let a = render(&[ball()], &small()).unwrap();
        assert_eq!(a, render(&[ball()], &small()).unwrap());
        let mut bad = ball();
        bad.positions[7].y = f64::NAN;
        let text = render(&[bad], &small()).unwrap_err().message;
        assert!(text.contains("vertex 7"), "{text}");
        let mut bad = ball();
        bad.triangles[3][1] = 1_000_000;
        let text = render(&[bad], &small()).unwrap_err().message;
        assert!(text.contains("triangle 3"), "{text}");
    }
}
