//! Where bodies and pins are at a time.
//!
//! Keyframes are held before the first and after the last; between two of them positions go along
//! the straight line and rotations along the great circle, at constant speed. A deforming mesh is
//! given by frames at a constant rate, straight lines between them; `repeat` starts over after the
//! last frame, which then should equal the first.

use crate::body::Pose;
use crate::math::Vec3;

/// Pose of a body at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseKey {
    /// Time [s].
    pub time: f64,
    /// Pose then.
    pub pose: Pose,
}

/// Displacement of a pin at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffsetKey {
    /// Time [s].
    pub time: f64,
    /// Displacement from the pin's place [m].
    pub offset: Vec3,
}

/// How a body moves.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct BodyMotion {
    /// Poses, times increasing; one alone is a body at rest, none the identity.
    pub keys: Vec<PoseKey>,
    /// Vertices of a deforming mesh, body frame [m]; every frame as long as the mesh.
    pub frames: Vec<Vec<[f64; 3]>>,
    /// Frames per second [1/s].
    pub rate: f64,
    /// Starts over after the last frame.
    pub repeat: bool,
}

/// Keys around a time and the fraction between them.
fn between<T>(keys: &[T], time: impl Fn(&T) -> f64, at: f64) -> Option<(usize, usize, f64)> {
    let next = keys.partition_point(|k| time(k) <= at);
    if keys.is_empty() {
        None
    } else if next == 0 {
        Some((0, 0, 0.0))
    } else if next == keys.len() {
        Some((next - 1, next - 1, 0.0))
    } else {
        let (a, b) = (time(&keys[next - 1]), time(&keys[next]));
        Some((next - 1, next, (at - a) / (b - a)))
    }
}

impl BodyMotion {
    /// A body that stays at one pose.
    pub fn fixed(pose: Pose) -> Self {
        Self {
            keys: vec![PoseKey { time: 0.0, pose }],
            ..Self::default()
        }
    }

    /// Pose at a time [s].
    pub fn pose(&self, time: f64) -> Pose {
        match between(&self.keys, |k| k.time, time) {
            None => Pose::default(),
            Some((a, b, t)) => self.keys[a].pose.toward(&self.keys[b].pose, t),
        }
    }

    /// Vertices of the deforming mesh at a time, if it deforms.
    pub fn vertices(&self, time: f64) -> Option<Vec<[f64; 3]>> {
        let last = self.frames.len().checked_sub(1)?;
        let mut at = (time * self.rate).max(0.0);
        if self.repeat && last > 0 {
            at %= last as f64;
        }
        let first = (at.floor() as usize).min(last);
        let t = at - first as f64;
        let (a, b) = (&self.frames[first], &self.frames[(first + 1).min(last)]);
        if first == last || t <= 0.0 {
            return Some(a.clone());
        }
        Some(
            a.iter()
                .zip(b)
                .map(|(p, q)| [0, 1, 2].map(|k| p[k] + t * (q[k] - p[k])))
                .collect(),
        )
    }

    /// Whether anything changes with time.
    pub fn moves(&self) -> bool {
        self.keys.len() > 1 || self.frames.len() > 1
    }
}

/// Displacement at a time; zero without keys.
pub fn offset(keys: &[OffsetKey], time: f64) -> Vec3 {
    between(keys, |k| k.time, time).map_or_else(Vec3::zeros, |(a, b, t)| {
        keys[a].offset.lerp(&keys[b].offset, t)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rotation;

    #[test]
    fn keyframes_are_hit_held_outside_and_straight_between() {
        let key = |time, x, angle: f64| PoseKey {
            time,
            pose: Pose {
                position: Vec3::x() * x,
                rotation: Rotation::from_axis_angle(&Vec3::y_axis(), angle),
            },
        };
        let motion = BodyMotion {
            keys: vec![key(1.0, 0.0, 0.0), key(2.0, 1.0, 1.0), key(4.0, 1.0, 0.0)],
            ..BodyMotion::default()
        };
        for (t, x, angle) in [
            (0.0, 0., 0.),
            (1.25, 0.25, 0.25),
            (2.0, 1., 1.),
            (3.0, 1., 0.5),
            (9.0, 1., 0.),
        ] {
            let pose = motion.pose(t);
            assert!((pose.position.x - x).abs() < 1e-12);
            assert!((pose.rotation.angle() - angle).abs() < 1e-12, "{t}");
        }
        assert_eq!(BodyMotion::default().pose(3.0), Pose::default());
    }

    #[test]
    fn frames_repeat_or_hold() {
        let mut motion = BodyMotion {
            frames: vec![vec![[0.0; 3]], vec![[1.0, 0.0, 0.0]], vec![[0.0; 3]]],
            rate: 10.0,
            ..BodyMotion::default()
        };
        let x = |m: &BodyMotion, t: f64| m.vertices(t).unwrap()[0][0];
        assert!((x(&motion, 0.05) - 0.5).abs() < 1e-12);
        assert!((x(&motion, 0.1) - 1.0).abs() < 1e-12);
        assert!(x(&motion, 0.25).abs() < 1e-12);
        motion.repeat = true;
        assert!((x(&motion, 0.25) - 0.5).abs() < 1e-12);
        assert_eq!(BodyMotion::default().vertices(0.0), None);
    }
}
