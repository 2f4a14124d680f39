//! PC2 point caches, as Blender and other programs read them for mesh playback.
//!
//! Layout, little endian: the 12 bytes `POINTCACHE2\0`, version (i32, 1), points (i32), start frame
//! (f32), frames per sample (f32), samples (i32), then three f32 for each point of each sample.

use crate::error::{Error, Result};
use crate::math::Vec3;

/// The cache of some frames, each with the same number of points.
pub fn to_pc2(frames: &[Vec<Vec3>]) -> Result<Vec<u8>> {
    let points = frames.first().map_or(0, Vec::len);
    let count = |n: usize, what: &str| {
        i32::try_from(n).map_err(|_| Error::limit(format!("{n} {what} in a PC2 cache")))
    };
    let mut out = Vec::with_capacity(32 + 12 * points * frames.len());
    out.extend_from_slice(b"POINTCACHE2\0");
    out.extend_from_slice(&1_i32.to_le_bytes());
    out.extend_from_slice(&count(points, "points")?.to_le_bytes());
    out.extend_from_slice(&0.0_f32.to_le_bytes());
    out.extend_from_slice(&1.0_f32.to_le_bytes());
    out.extend_from_slice(&count(frames.len(), "samples")?.to_le_bytes());
    for (i, frame) in frames.iter().enumerate() {
        if frame.len() != points {
            return Err(Error::argument(format!(
                "PC2 frame {i} has {} points, the first has {points}",
                frame.len()
            )));
        }
        for p in frame {
            for c in p.iter() {
                out.extend_from_slice(&(*c as f32).to_le_bytes());
            }
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_and_size_are_those_of_the_format() {
        let frames = vec![vec![Vec3::x(), Vec3::y()]; 3];
        let bytes = to_pc2(&frames).unwrap();
        assert_eq!(&bytes[..12], b"POINTCACHE2\0");
        assert_eq!(bytes.len(), 32 + 3 * 2 * 12);
        assert_eq!(bytes[16..20], 2_i32.to_le_bytes());
        assert_eq!(bytes[28..32], 3_i32.to_le_bytes());
        assert!(to_pc2(&[vec![], vec![Vec3::x()]]).is_err());
    }
}
