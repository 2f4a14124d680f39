//! Planes in pictures: floors, walls and slopes have no end and must not decide what is framed.
//!
//! A body whose mesh is flat is taken for the plane that it lies in. A level one under everything
//! becomes the ground of the picture, which catches shadows. Any other is drawn as a square tile
//! around the foot of the garment on it, cut finely enough to carry shadows, and from its outer
//! side only, so that a wall between the eye and the garment hides nothing.

use super::super::Part;
use super::camera::Frame;
use crate::math::Vec3;

/// Cells along a side of a tile.
const CELLS: u32 = 48;
/// Half of a tile's side in half extents of the frame.
const SIZE: f64 = 1.3;

/// A plane with its outer side.
#[derive(Clone, Copy, Debug)]
struct Plane {
    point: Vec3,
    normal: Vec3,
}

/// The plane of a body that is flat.
fn plane(part: &Part) -> Option<Plane> {
    if part.cloth {
        return None;
    }
    let first = part.triangles.first()?;
    let [a, b, c] = first.map(|v| part.positions[v as usize]);
    let normal = (b - a).cross(&(c - a)).try_normalize(1e-300)?;
    let size = part
        .positions
        .iter()
        .map(|x| (x - a).norm())
        .fold(0.0, f64::max);
    let flat = |x: &Vec3| (x - a).dot(&normal).abs() <= 1e-9 * size;
    part.positions
        .iter()
        .all(flat)
        .then_some(Plane { point: a, normal })
}

/// Whether a part is drawn as a plane without end.
pub(super) fn is_backdrop(part: &Part) -> bool {
    plane(part).is_some()
}

/// The parts as they are drawn, each with whether it is seen from outside only, and the height of
/// the ground along up [m].
pub(super) fn arrange(parts: &[Part], frame: &Frame) -> (Vec<(Part, bool)>, f64) {
    let mut drawn = Vec::with_capacity(parts.len());
    let mut ground = frame.lowest;
    let size = frame.half.iter().copied().fold(0.0, f64::max);
    let mut floor: Option<f64> = None;
    for part in parts {
        let Some(plane) = plane(part) else {
            drawn.push((part.clone(), false));
            continue;
        };
        let height = plane.point.dot(&frame.up);
        if plane.normal.dot(&frame.up) > 1.0 - 1e-6 && height <= frame.lowest + 0.02 * size {
            floor = Some(floor.map_or(height, |f| f.max(height)));
            continue;
        }
        let tile = tile(part, plane, frame, SIZE * size);
        for x in &tile.positions {
            ground = ground.min(x.dot(&frame.up));
        }
        drawn.push((tile, true));
    }
    (drawn, floor.unwrap_or(ground))
}

/// A square of a plane, its middle nearest to the middle of the frame.
fn tile(part: &Part, plane: Plane, frame: &Frame, half: f64) -> Part {
    let n = plane.normal;
    let middle = frame.centre - n * (frame.centre - plane.point).dot(&n);
    // level along one side where the plane has a level direction of its own
    let u = n.cross(&frame.up).try_normalize(1e-6).unwrap_or(frame.side);
    let v = n.cross(&u);
    let at = |k: u32| half * (2.0 * f64::from(k) / f64::from(CELLS) - 1.0);
    let row = CELLS + 1;
    let mut positions = Vec::with_capacity((row * row) as usize);
    let mut triangles = Vec::with_capacity((2 * CELLS * CELLS) as usize);
    for j in 0..row {
        for i in 0..row {
            positions.push(middle + u * at(i) + v * at(j));
            if i < CELLS && j < CELLS {
                let [a, b] = [j * row + i, (j + 1) * row + i];
                triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
            }
        }
    }
    Part::body(&part.name, positions, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(name: &str, at: Vec3, turn: impl Fn(f64, f64) -> Vec3) -> Part {
        let corners = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)];
        let positions = corners.iter().map(|&(a, b)| at + turn(a, b)).collect();
        Part::body(name, positions, vec![[0, 1, 2], [0, 2, 3]])
    }

    fn cloth() -> Part {
        let x = [[0.0, 1.0, 0.0], [0.4, 1.0, 0.0], [0.0, 1.5, 0.1]].map(Vec3::from);
        Part::garment("cloth", &x, &[[0, 1, 2]], &[0; 3])
    }

    fn frame(parts: &[Part]) -> Frame {
        Frame::of(parts, &Vec3::y(), &Vec3::z())
    }

    #[test]
    fn planes_do_not_change_what_is_framed() {
        let alone = frame(&[cloth()]);
        let floor = square("floor", Vec3::zeros(), |a, b| Vec3::new(a, 0.0, -b));
        let slope = square("slope", Vec3::x() * 50.0, |a, b| Vec3::new(a, 0.5 * b, -b));
        for planes in [vec![floor.clone()], vec![slope.clone()], vec![floor, slope]] {
            let mut parts = planes;
            parts.push(cloth());
            assert_eq!(frame(&parts).centre, alone.centre);
            assert_eq!(frame(&parts).half, alone.half);
        }
    }

    #[test]
    fn a_floor_below_is_the_ground_and_a_slope_is_a_tile_on_its_plane() {
        let floor = square("floor", Vec3::y() * 0.25, |a, b| Vec3::new(a, 0.0, -b));
        let parts = [floor, cloth()];
        let (drawn, ground) = arrange(&parts, &frame(&parts));
        assert_eq!(drawn.len(), 1);
        assert!((ground - 0.25).abs() < 1e-12);

        let slope = square("slope", Vec3::x() * 50.0, |a, b| Vec3::new(a, 0.5 * b, -b));
        let parts = [slope, cloth()];
        let (drawn, ground) = arrange(&parts, &frame(&parts));
        let (tile, outside_only) = &drawn[0];
        assert!(outside_only & !drawn[1].1);
        let normal = Vec3::new(0.0, 1.0, 0.5).normalize();
        let mut middle = Vec3::zeros();
        for x in &tile.positions {
            assert!(x.dot(&normal).abs() < 1e-9 && x.y >= ground - 1e-12);
            middle += x / tile.positions.len() as f64;
        }
        assert!((middle - frame(&parts).centre).norm() < 2.0, "{middle}");
        let [a, b, c] = tile.triangles[0].map(|v| tile.positions[v as usize]);
        assert!(
            (b - a).cross(&(c - a)).dot(&normal) > 0.0,
            "outer side kept"
        );
    }

    #[test]
    fn a_closed_body_and_flat_cloth_are_no_backdrop() {
        let (x, t) = crate::body::Body::sphere(0.3).unwrap().display_mesh();
        assert!(!is_backdrop(&Part::body("ball", x, t)));
        assert!(!is_backdrop(&cloth()));
        assert!(!is_backdrop(&Part::body("empty", Vec::new(), Vec::new())));
    }
}
