//! From depth buffers to pixels: shading, shadows on the ground, lines, outlines, filtering.
//!
//! Light on a surface: `colour (sky S + key K max(0, n . l) V + fill) + sheen`, in linear light;
//! `S` and `V` come from `light`. The sheen is Phong's lobe with a Fresnel-like weight, faint, so
//! that cloth stays cloth. Lines darken by coverage; outlines are drawn where the depth jumps.

use super::camera::Camera;
use super::light::{Floor, Lamp, Light};
use super::raster::{Buffer, NONE};
use super::{Picture, Scene, palette};
use crate::math::Vec3;
use crate::math::parallel::Workers;

/// Depth jump that counts as an outline [m].
const JUMP: f32 = 0.012;

/// The picture in linear light at subpixel resolution.
pub(crate) struct Canvas {
    width: usize,
    height: usize,
    colour: Vec<[f32; 3]>,
    buffer: Buffer,
    ink: Vec<f32>,
}

impl Canvas {
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let top = palette::SKY.map(palette::to_linear);
        let bottom = palette::FLOOR.map(palette::to_linear);
        let mut colour = Vec::with_capacity(width * height);
        for y in 0..height {
            let t = (y as f32 + 0.5) / height as f32;
            let t = t * t * (3.0 - 2.0 * t);
            let row = [0, 1, 2].map(|k| top[k] * (1.0 - t) + bottom[k] * t);
            colour.extend(std::iter::repeat_n(row, width));
        }
        Self {
            width,
            height,
            colour,
            buffer: Buffer::new(width, height),
            ink: vec![0.0; width * height],
        }
    }

    /// Draws one view into its columns.
    pub(crate) fn draw(
        &mut self,
        scene: &Scene,
        floor: &Floor,
        light: &Light,
        lamp: &Lamp,
        camera: &Camera,
        workers: &Workers,
    ) {
        let screen: Vec<Option<[f64; 3]>> =
            scene.positions.iter().map(|x| camera.project(x)).collect();
        for (i, t) in scene.triangles.iter().enumerate() {
            if scene.one_sided[i] && turned_away(scene, t, &camera.eye) {
                continue;
            }
            let [a, b, c] = t.map(|v| screen[v as usize]);
            if let (Some(a), Some(b), Some(c)) = (a, b, c) {
                self.buffer.triangle([a, b, c], i as u32, camera.columns);
            }
        }
        for &[a, b] in &scene.lines {
            if let (Some(a), Some(b)) = (screen[a as usize], screen[b as usize]) {
                self.line(a, b, camera);
            }
        }
        let (buffer, ink, width) = (&self.buffer, &self.ink, self.width);
        let inked = palette::INK.map(palette::to_linear);
        workers.chunks(&mut self.colour, width, |y, row| {
            for x in camera.columns[0]..camera.columns[1] {
                let i = y * width + x;
                let ray = camera.ray(x as f64 + 0.5, y as f64 + 0.5);
                let t = buffer.triangle[i];
                let mut c = if t == NONE {
                    ground(row[x], floor, light, lamp, camera, &ray, x)
                } else {
                    surface(scene, light, lamp, camera, &ray, t)
                };
                let dark = ink[i].max(outline(buffer, camera, x, y));
                for k in 0..3 {
                    c[k] = c[k] * (1.0 - dark) + inked[k] * dark;
                }
                row[x] = c;
            }
        });
    }

    /// A line of about one pixel where nothing stands clearly before it.
    fn line(&mut self, a: [f64; 3], b: [f64; 3], camera: &Camera) {
        const HALF: f64 = 1.1;
        const STRENGTH: f32 = 0.62;
        let d = [b[0] - a[0], b[1] - a[1]];
        let length2 = (d[0] * d[0] + d[1] * d[1]).max(1e-12);
        let range = |k: usize, max: usize| {
            let lo = (a[k].min(b[k]) - HALF - 1.0).clamp(0.0, max as f64) as usize;
            let hi = (a[k].max(b[k]) + HALF + 1.0).clamp(0.0, max as f64) as usize;
            (lo, hi)
        };
        let (x0, x1) = range(0, self.width);
        let (y0, y1) = range(1, self.height);
        for y in y0..y1 {
            for x in x0.max(camera.columns[0])..x1.min(camera.columns[1]) {
                let p = [x as f64 + 0.5 - a[0], y as f64 + 0.5 - a[1]];
                let t = ((p[0] * d[0] + p[1] * d[1]) / length2).clamp(0.0, 1.0);
                let away = ((p[0] - t * d[0]).powi(2) + (p[1] - t * d[1]).powi(2)).sqrt();
                let cover = (HALF + 0.5 - away).clamp(0.0, 1.0) as f32;
                if cover <= 0.0 {
                    continue;
                }
                let q = a[2] + t * (b[2] - a[2]);
                let i = y * self.width + x;
                // hidden if the surface there is more than some millimetres nearer
                let surface = f64::from(self.buffer.nearness[i]);
                if surface > 0.0 && 1.0 / q - 1.0 / surface > 0.006 {
                    continue;
                }
                self.ink[i] = self.ink[i].max(STRENGTH * cover);
            }
        }
    }

    /// Averages `sub x sub` subpixels and encodes sRGB, with a dither against banding.
    pub(crate) fn resolve(&self, sub: usize) -> Picture {
        let (width, height) = (self.width / sub, self.height / sub);
        let mut rgb = vec![0_u8; 3 * width * height];
        let share = 1.0 / (sub * sub) as f32;
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0.0_f32; 3];
                for j in 0..sub {
                    for i in 0..sub {
                        let c = self.colour[(y * sub + j) * self.width + x * sub + i];
                        for k in 0..3 {
                            sum[k] += c[k].clamp(0.0, 1.0);
                        }
                    }
                }
                // ordered dither (Bayer 4 x 4), half a level in size
                const BAYER: [[f32; 4]; 4] = [
                    [0.0, 8.0, 2.0, 10.0],
                    [12.0, 4.0, 14.0, 6.0],
                    [3.0, 11.0, 1.0, 9.0],
                    [15.0, 7.0, 13.0, 5.0],
                ];
                let noise = BAYER[y % 4][x % 4] / 16.0 - 0.47;
                for k in 0..3 {
                    let v = palette::to_srgb(sum[k] * share) * 255.0 + noise;
                    rgb[3 * (y * width + x) + k] = v.round().clamp(0.0, 255.0) as u8;
                }
            }
        }
        Picture { width, height, rgb }
    }
}

/// Whether the eye is on the inner side of a triangle.
fn turned_away(scene: &Scene, triangle: &[u32; 3], eye: &Vec3) -> bool {
    let [a, b, c] = triangle.map(|v| scene.positions[v as usize]);
    (b - a).cross(&(c - a)).dot(&(eye - a)) <= 0.0
}

fn surface(
    scene: &Scene,
    light: &Light,
    lamp: &Lamp,
    camera: &Camera,
    ray: &Vec3,
    t: u32,
) -> [f32; 3] {
    let tri = scene.triangles[t as usize].map(|v| v as usize);
    let [a, b, c] = tri.map(|v| scene.positions[v]);
    // barycentric weights of the ray's point (Moller and Trumbore)
    let (e1, e2) = (b - a, c - a);
    let h = ray.cross(&e2);
    let det = e1.dot(&h);
    let (mut wb, mut wc) = (1.0 / 3.0, 1.0 / 3.0);
    if det.abs() > 1e-300 {
        let s = (camera.eye - a) / det;
        wb = s.dot(&h).clamp(0.0, 1.0);
        wc = ray.dot(&s.cross(&e1)).clamp(0.0, 1.0 - wb);
    }
    let w = [1.0 - wb - wc, wb, wc];
    let mut n = Vec3::zeros();
    for k in 0..3 {
        n += scene.normals[tri[k]] * w[k];
    }
    let view = -ray.normalize();
    let face = e1.cross(&e2);
    // the side that is seen is told by the triangle, not by the bent normal
    let back = face.dot(&view) < 0.0;
    let side = usize::from(back);
    let mut n = n.try_normalize(1e-12).unwrap_or(view);
    if back {
        n = -n;
    }
    let mix = |f: &dyn Fn(usize) -> f32| -> f32 { (0..3).map(|k| w[k] as f32 * f(tri[k])).sum() };
    let sky = mix(&|v| light.sky[v][side]);
    let key = mix(&|v| lamp.visible[v]);
    let l = lamp.direction;
    let facing = n.dot(&l).max(0.0) as f32;
    let fill = 0.10 + 0.10 * n.dot(&view).max(0.0) as f32;
    let half = (l + view).normalize();
    let rim = (1.0 - n.dot(&view).clamp(0.0, 1.0)).powi(3) as f32;
    let cloth = scene.cloth[t as usize];
    let sheen = if cloth { 0.025 } else { 0.05 } * n.dot(&half).max(0.0).powi(18) as f32 * key;
    let velvet = if cloth { 0.10 } else { 0.04 } * rim * sky;
    let base = [0, 1, 2].map(|k| mix(&|v| scene.colours[v][k]));
    let inside = if cloth && back { 0.82 } else { 1.0 };
    // a warm lamp and a cool sky
    let sky_tint = [0.93, 0.98, 1.08];
    let key_tint = [1.06, 1.0, 0.92];
    [0, 1, 2].map(|k| {
        let e = 0.74 * sky * sky_tint[k] + 0.78 * facing * key * key_tint[k] + fill;
        base[k] * inside * e + sheen + velvet * (0.5 + 0.5 * base[k])
    })
}

fn ground(
    behind: [f32; 3],
    floor: &Floor,
    light: &Light,
    lamp: &Lamp,
    camera: &Camera,
    ray: &Vec3,
    column: usize,
) -> [f32; 3] {
    let down = ray.dot(&floor.up);
    let height = (camera.eye - floor.origin).dot(&floor.up);
    if down >= -1e-9 || height <= 0.0 {
        return behind;
    }
    let x = camera.eye + ray * (height / -down);
    let (sky, inside) = floor.sample(&light.floor_sky, &x);
    let (key, _) = floor.sample(&lamp.floor, &x);
    let lit = (0.62 * sky.min(1.0) + 0.38 * key).clamp(0.0, 1.0);
    // shadows fade out toward the neighbouring view
    let [left, right] = camera.columns;
    let border = (column - left).min(right - 1 - column) as f32;
    let fade = (border / (0.16 * (right - left) as f32)).clamp(0.0, 1.0);
    let fade = fade * fade * (3.0 - 2.0 * fade);
    let dark = 1.0 - inside * fade * 0.75 * (1.0 - lit);
    behind.map(|c| c * dark)
}

/// Strength of ink where a surface ends before a farther one.
fn outline(buffer: &Buffer, camera: &Camera, x: usize, y: usize) -> f32 {
    let at = |x: usize, y: usize| buffer.nearness[y * buffer.width + x];
    let own = at(x, y);
    if own <= 0.0 || !own.is_finite() {
        return 0.0;
    }
    let mut jump = 0.0_f32;
    let columns = camera.columns;
    for (dx, dy) in [(-1_i32, 0_i32), (1, 0), (0, -1), (0, 1)] {
        let (nx, ny) = (x as i32 + dx, y as i32 + dy);
        if nx < columns[0] as i32 || nx >= columns[1] as i32 || ny < 0 || ny >= buffer.height as i32
        {
            continue;
        }
        let other = at(nx as usize, ny as usize);
        let depth = if other > 0.0 {
            1.0 / other
        } else {
            f32::INFINITY
        };
        jump = jump.max(depth - 1.0 / own);
    }
    0.55 * ((jump - JUMP) / JUMP).clamp(0.0, 1.0)
}
