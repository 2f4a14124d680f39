//! Soft light at vertices: the share of the sky and of the key light that reaches them.
//!
//! For each of a fixed set of directions the scene is drawn as a depth map in parallel projection;
//! a vertex sees that direction if nothing in the map is nearer than itself by more than a bias.
//! Sky: `sum w_i max(0, n . d_i) V_i / sum w_i max(0, d_i . up)`, the irradiance of an overcast
//! sky (Moon and Spencer 1942: brightness `1 + 2 sin(elevation)`) relative to open ground. Key: the
//! mean visibility of directions within a cone about the lamp. Both sides of cloth are kept.

use super::Scene;
use super::camera::Frame;
use super::raster::Buffer;
use crate::math::Vec3;
use crate::math::parallel::Workers;

const MAP: usize = 448;
const GROUP: usize = 9;
const SKY_DIRECTIONS: usize = 6 * GROUP;
const KEY_DIRECTIONS: usize = GROUP;
const FLOOR_CELLS: usize = 96;

/// The ground as a grid that catches shadows.
pub(crate) struct Floor {
    pub(crate) origin: Vec3,
    pub(crate) side: Vec3,
    pub(crate) front: Vec3,
    pub(crate) up: Vec3,
    /// Length of a cell [m].
    pub(crate) cell: f64,
    points: Vec<Vec3>,
}

impl Floor {
    pub(crate) fn new(frame: &Frame, height: f64) -> Self {
        let half = 2.2 * frame.ball.1;
        let cell = 2.0 * half / FLOOR_CELLS as f64;
        let up = frame.up;
        let middle = frame.centre - up * (frame.centre.dot(&up) - height);
        let origin = middle - (frame.side + frame.front) * half;
        let points = (0..(FLOOR_CELLS + 1) * (FLOOR_CELLS + 1))
            .map(|i| {
                let (r, c) = (i / (FLOOR_CELLS + 1), i % (FLOOR_CELLS + 1));
                origin + frame.side * (c as f64 * cell) + frame.front * (r as f64 * cell)
            })
            .collect();
        Self {
            origin,
            side: frame.side,
            front: frame.front,
            up,
            cell,
            points,
        }
    }

    /// Bilinear value of a grid of `light` at a ground point and how far inside the grid it is,
    /// 0 at the border to 1.
    pub(crate) fn sample(&self, light: &[f32], x: &Vec3) -> (f32, f32) {
        let d = x - self.origin;
        let n = FLOOR_CELLS as f64;
        let (u, v) = (
            d.dot(&self.side) / self.cell,
            d.dot(&self.front) / self.cell,
        );
        if !(u > 0.0 && v > 0.0 && u < n && v < n) {
            return (1.0, 0.0);
        }
        let (c, r) = (u as usize, v as usize);
        let (fu, fv) = ((u - c as f64) as f32, (v - r as f64) as f32);
        let at = |r: usize, c: usize| light[r * (FLOOR_CELLS + 1) + c];
        let low = at(r, c) * (1.0 - fu) + at(r, c + 1) * fu;
        let high = at(r + 1, c) * (1.0 - fu) + at(r + 1, c + 1) * fu;
        let inside = (2.0 * u / n - 1.0).abs().max((2.0 * v / n - 1.0).abs());
        (
            low * (1.0 - fv) + high * fv,
            ((1.0 - inside) * 3.0).clamp(0.0, 1.0) as f32,
        )
    }
}

/// Light at the vertices of a scene and of its floor.
pub(crate) struct Light {
    /// Sky light on the side of the normal and on the other, shape `[vertex_count]`.
    pub(crate) sky: Vec<[f32; 2]>,
    /// Sky on the floor's grid.
    pub(crate) floor_sky: Vec<f32>,
    /// The key lamp of each view.
    pub(crate) lamps: Vec<Lamp>,
}

/// A key lamp; it turns with the view, so that every side is seen well lit.
pub(crate) struct Lamp {
    /// Unit vector to the lamp.
    pub(crate) direction: Vec3,
    /// Visible share of the lamp at each vertex.
    pub(crate) visible: Vec<f32>,
    /// Visible share of the lamp on the floor's grid.
    pub(crate) floor: Vec<f32>,
}

/// One direction of light and what it counts for.
struct Ray {
    direction: Vec3,
    sky: f32,
    lamp: usize,
}

impl Light {
    pub(crate) fn new(
        scene: &Scene,
        floor: &Floor,
        frame: &Frame,
        views: &[f64],
        workers: &Workers,
    ) -> Self {
        let axes = (frame.side, frame.up, frame.front);
        let world = |d: [f64; 3]| axes.0 * d[0] + axes.1 * d[1] + axes.2 * d[2];
        // sky: golden-angle points over the upper hemisphere, a little below the horizon too
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let mut rays: Vec<Ray> = (0..SKY_DIRECTIONS)
            .map(|i| {
                let y = 1.0 - 1.12 * (i as f64 + 0.5) / SKY_DIRECTIONS as f64;
                let r = (1.0 - y * y).max(0.0).sqrt();
                let a = golden * i as f64;
                Ray {
                    direction: world([r * a.cos(), y, r * a.sin()]),
                    sky: ((1.0 + 2.0 * y.max(0.0)) / 3.0) as f32,
                    lamp: usize::MAX,
                }
            })
            .collect();
        let mut lamps = Vec::new();
        for (lamp, &view) in views.iter().enumerate() {
            let (s, c) = view.sin_cos();
            let [x, y, z] = [-0.52, 0.95, 0.66];
            let direction = world([x * c + z * s, y, z * c - x * s]).normalize();
            let t = direction.cross(&axes.1).normalize();
            let b = direction.cross(&t);
            for i in 0..KEY_DIRECTIONS {
                let r = 0.11 * ((i as f64 + 0.5) / KEY_DIRECTIONS as f64).sqrt();
                let a = golden * i as f64;
                rays.push(Ray {
                    direction: (direction + t * (r * a.cos()) + b * (r * a.sin())).normalize(),
                    sky: 0.0,
                    lamp,
                });
            }
            lamps.push(direction);
        }
        let open: f32 = rays
            .iter()
            .map(|r| r.sky * r.direction.dot(&axes.1).max(0.0) as f32)
            .sum();
        let n = scene.positions.len();
        let m = floor.points.len();
        // rays in fixed groups, added in order: the same bits for any number of threads
        let mut groups: Vec<Vec<[f32; 2]>> = vec![Vec::new(); rays.len().div_ceil(GROUP)];
        workers.chunks(&mut groups, 1, |g, out| {
            let mut sums = vec![[0.0; 2]; n + m];
            let mut map = Map::new(frame);
            for ray in rays.iter().skip(g * GROUP).take(GROUP) {
                let d = &ray.direction;
                map.draw(scene, d);
                for v in 0..n {
                    let c = scene.normals[v].dot(d);
                    // a surface is lifted off itself toward the light
                    let lift = scene.normals[v] * (map.lift * c.signum());
                    if map.sees(&(scene.positions[v] + lift)) {
                        if ray.lamp == usize::MAX {
                            sums[v][usize::from(c < 0.0)] += ray.sky * c.abs() as f32;
                        } else {
                            sums[v][0] += 1.0 / KEY_DIRECTIONS as f32;
                        }
                    }
                }
                let c = d.dot(&axes.1) as f32;
                for (k, p) in floor.points.iter().enumerate() {
                    if c > 0.0 && map.sees(&(p + axes.1 * map.lift)) {
                        sums[n + k][0] += if ray.lamp == usize::MAX {
                            ray.sky * c
                        } else {
                            1.0 / KEY_DIRECTIONS as f32
                        };
                    }
                }
            }
            out[0] = sums;
        });
        // a lamp's rays fill whole groups of their own, after those of the sky
        let sky_groups = SKY_DIRECTIONS / GROUP;
        let sky =
            |i: usize, k: usize| groups[..sky_groups].iter().map(|g| g[i][k]).sum::<f32>() / open;
        Self {
            sky: (0..n).map(|v| [sky(v, 0), sky(v, 1)]).collect(),
            floor_sky: (n..n + m).map(|v| sky(v, 0)).collect(),
            lamps: lamps
                .into_iter()
                .zip(&groups[sky_groups..])
                .map(|(direction, g)| Lamp {
                    direction,
                    visible: g[..n].iter().map(|s| s[0]).collect(),
                    floor: g[n..].iter().map(|s| s[0]).collect(),
                })
                .collect(),
        }
    }
}

/// A depth map in parallel projection along one direction.
struct Map {
    buffer: Buffer,
    centre: Vec3,
    scale: f64,
    axes: [Vec3; 3],
    /// How far a point is moved off its own surface [m].
    lift: f64,
}

impl Map {
    fn new(frame: &Frame) -> Self {
        let scale = 0.5 * MAP as f64 / frame.ball.1;
        Self {
            buffer: Buffer::new(MAP, MAP),
            centre: frame.ball.0,
            scale,
            axes: [Vec3::x(), Vec3::y(), Vec3::z()],
            lift: 1.2 / scale,
        }
    }

    fn screen(&self, x: &Vec3) -> [f64; 3] {
        let d = x - self.centre;
        [
            0.5 * MAP as f64 + self.scale * d.dot(&self.axes[0]),
            0.5 * MAP as f64 + self.scale * d.dot(&self.axes[1]),
            d.dot(&self.axes[2]),
        ]
    }

    fn draw(&mut self, scene: &Scene, direction: &Vec3) {
        let helper = if direction.y.abs() < 0.9 {
            Vec3::y()
        } else {
            Vec3::x()
        };
        let a = helper.cross(direction).normalize();
        self.axes = [a, direction.cross(&a), *direction];
        self.buffer.clear();
        let screen: Vec<[f64; 3]> = scene.positions.iter().map(|x| self.screen(x)).collect();
        for (i, t) in scene.triangles.iter().enumerate() {
            let p = t.map(|v| screen[v as usize]);
            self.buffer.triangle(p, i as u32, [0, MAP]);
        }
    }

    /// Whether nothing stands between a point and the lamp; points off the map are in the open.
    fn sees(&self, x: &Vec3) -> bool {
        let [sx, sy, q] = self.screen(x);
        let (w, h) = (MAP as f64, MAP as f64);
        if !(sx >= 0.0 && sy >= 0.0 && sx < w && sy < h) {
            return true;
        }
        let nearest = self.buffer.nearness[sy as usize * MAP + sx as usize];
        f64::from(nearest) <= q + 1.4 / self.scale
    }
}
