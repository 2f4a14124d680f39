//! glTF 2.0 in one binary file (.glb): garment and bodies, normals, a colour for each vertex.
//!
//! Vertices are single precision, as the format has no other; colours are linear light as the
//! format asks. Further frames of a part become morph targets, each the difference to its own
//! positions; one animation plays those of all parts.

use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::readout::{Part, palette, surface};
use gltf_json as json;
use json::validation::{Checked::Valid, USize64};
use json::{Index, Root};

/// Positions of a part's later frames and when they are reached.
#[derive(Clone, Debug, PartialEq)]
pub struct Animation<'a> {
    /// Which part moves.
    pub part: usize,
    /// Times [s], increasing; shape `[frames]`.
    pub times: &'a [f64],
    /// Positions of every frame, each as long as the part's own.
    pub frames: &'a [Vec<Vec3>],
}

/// The parts as a .glb file; `motions` has at most one entry for a part.
pub fn to_glb(parts: &[Part], motions: &[Animation<'_>]) -> Result<Vec<u8>> {
    let mut file = File::default();
    let mut played = (Vec::new(), Vec::new());
    let mut nodes = Vec::new();
    for (i, part) in parts.iter().enumerate() {
        part.check()?;
        if part.positions.is_empty() || part.triangles.is_empty() {
            continue;
        }
        let moving = motions.iter().find(|a| a.part == i && !a.frames.is_empty());
        let mesh = file.mesh(part, moving)?;
        let node = file.root.push(json::Node {
            mesh: Some(mesh),
            name: Some(part.name.clone()),
            ..json::Node::default()
        });
        if let Some(a) = moving {
            let index = Index::new(played.1.len() as u32);
            let (channel, sampler) = file.animate(node, index, a)?;
            played.0.push(channel);
            played.1.push(sampler);
        }
        nodes.push(node);
    }
    if !played.0.is_empty() {
        let _ = file.root.push(json::Animation {
            extensions: None,
            extras: Default::default(),
            channels: played.0,
            name: Some("motion".into()),
            samplers: played.1,
        });
    }
    let scene = file.root.push(json::Scene {
        extensions: None,
        extras: Default::default(),
        name: None,
        nodes,
    });
    file.root.scene = Some(scene);
    file.finish()
}

#[derive(Default)]
struct File {
    root: Root,
    bytes: Vec<u8>,
}

type Accessor = Index<json::Accessor>;
type Played = (json::animation::Channel, json::animation::Sampler);

impl File {
    fn view(
        &mut self,
        data: &[u8],
        target: Option<json::buffer::Target>,
    ) -> Index<json::buffer::View> {
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(data);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.root.push(json::buffer::View {
            buffer: Index::new(0),
            byte_length: USize64::from(data.len()),
            byte_offset: Some(USize64::from(offset)),
            byte_stride: None,
            extensions: None,
            extras: Default::default(),
            name: None,
            target: target.map(Valid),
        })
    }

    fn accessor(
        &mut self,
        data: &[u8],
        count: usize,
        component: json::accessor::ComponentType,
        kind: json::accessor::Type,
        target: Option<json::buffer::Target>,
        bounds: Option<(Vec<f32>, Vec<f32>)>,
    ) -> Accessor {
        let view = self.view(data, target);
        let (min, max) = bounds.map_or((None, None), |(lo, hi)| {
            (Some(serde_json::json!(lo)), Some(serde_json::json!(hi)))
        });
        self.root.push(json::Accessor {
            buffer_view: Some(view),
            byte_offset: Some(USize64(0)),
            count: USize64::from(count),
            component_type: Valid(json::accessor::GenericComponentType(component)),
            extensions: None,
            extras: Default::default(),
            type_: Valid(kind),
            min,
            max,
            name: None,
            normalized: false,
            sparse: None,
        })
    }

    fn vectors(&mut self, values: &[[f32; 3]]) -> Accessor {
        let mut lo = vec![f32::INFINITY; 3];
        let mut hi = vec![f32::NEG_INFINITY; 3];
        let mut data = Vec::with_capacity(12 * values.len());
        for v in values {
            for k in 0..3 {
                lo[k] = lo[k].min(v[k]);
                hi[k] = hi[k].max(v[k]);
                data.extend_from_slice(&v[k].to_le_bytes());
            }
        }
        self.accessor(
            &data,
            values.len(),
            json::accessor::ComponentType::F32,
            json::accessor::Type::Vec3,
            Some(json::buffer::Target::ArrayBuffer),
            Some((lo, hi)),
        )
    }

    fn mesh(&mut self, part: &Part, moving: Option<&Animation<'_>>) -> Result<Index<json::Mesh>> {
        let single = |v: &Vec3| [v.x as f32, v.y as f32, v.z as f32];
        let positions: Vec<[f32; 3]> = part.positions.iter().map(single).collect();
        let normals: Vec<[f32; 3]> = surface::normals(&part.positions, &part.triangles)
            .iter()
            .map(|n| single(if n.norm_squared() > 0.0 { n } else { UP }))
            .collect();
        let colours: Vec<[f32; 3]> = part
            .colours
            .iter()
            .map(|c| c.map(palette::to_linear))
            .collect();
        let positions_at = self.vectors(&positions);
        let normals_at = self.vectors(&normals);
        let colours_at = self.vectors(&colours);
        let indices: Vec<u8> = part
            .triangles
            .iter()
            .flatten()
            .flat_map(|i| i.to_le_bytes())
            .collect();
        let indices_at = self.accessor(
            &indices,
            3 * part.triangles.len(),
            json::accessor::ComponentType::U32,
            json::accessor::Type::Scalar,
            Some(json::buffer::Target::ElementArrayBuffer),
            None,
        );
        let mut targets = Vec::new();
        for (f, frame) in moving.map_or(&[][..], |a| a.frames).iter().enumerate() {
            if frame.len() != part.positions.len() {
                return Err(Error::argument(format!(
                    "frame {f} has {} vertices, '{}' has {}",
                    frame.len(),
                    part.name,
                    part.positions.len()
                )));
            }
            let delta: Vec<[f32; 3]> = frame
                .iter()
                .zip(&part.positions)
                .map(|(x, x0)| single(&(x - x0)))
                .collect();
            targets.push(json::mesh::MorphTarget {
                positions: Some(self.vectors(&delta)),
                normals: None,
                tangents: None,
            });
        }
        let material = self.root.push(json::Material {
            name: Some(part.name.clone()),
            double_sided: part.cloth,
            pbr_metallic_roughness: json::material::PbrMetallicRoughness {
                metallic_factor: json::material::StrengthFactor(0.0),
                roughness_factor: json::material::StrengthFactor(if part.cloth {
                    0.9
                } else {
                    0.7
                }),
                ..Default::default()
            },
            ..Default::default()
        });
        let weights = (!targets.is_empty()).then(|| vec![0.0; targets.len()]);
        Ok(self.root.push(json::Mesh {
            extensions: None,
            extras: Default::default(),
            name: Some(part.name.clone()),
            primitives: vec![json::mesh::Primitive {
                attributes: [
                    (Valid(json::mesh::Semantic::Positions), positions_at),
                    (Valid(json::mesh::Semantic::Normals), normals_at),
                    (Valid(json::mesh::Semantic::Colors(0)), colours_at),
                ]
                .into_iter()
                .collect(),
                extensions: None,
                extras: Default::default(),
                indices: Some(indices_at),
                material: Some(material),
                mode: Valid(json::mesh::Mode::Triangles),
                targets: (!targets.is_empty()).then_some(targets),
            }],
            weights,
        }))
    }

    /// One key for each frame: its own target at weight one, all others at zero.
    fn animate(
        &mut self,
        node: Index<json::Node>,
        sampler: Index<json::animation::Sampler>,
        a: &Animation<'_>,
    ) -> Result<Played> {
        let n = a.frames.len();
        if a.times.len() != n {
            return Err(Error::argument(format!(
                "{} times for {n} frames",
                a.times.len()
            )));
        }
        let times: Vec<f32> = a.times.iter().map(|&t| t as f32).collect();
        let data: Vec<u8> = times.iter().flat_map(|t| t.to_le_bytes()).collect();
        let lo = times.iter().copied().fold(f32::INFINITY, f32::min);
        let hi = times.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let input = self.accessor(
            &data,
            n,
            json::accessor::ComponentType::F32,
            json::accessor::Type::Scalar,
            None,
            Some((vec![lo], vec![hi])),
        );
        let mut weights = Vec::with_capacity(4 * n * n);
        for i in 0..n {
            for j in 0..n {
                weights.extend_from_slice(&f32::from(u8::from(i == j)).to_le_bytes());
            }
        }
        let output = self.accessor(
            &weights,
            n * n,
            json::accessor::ComponentType::F32,
            json::accessor::Type::Scalar,
            None,
            None,
        );
        Ok((
            json::animation::Channel {
                sampler,
                target: json::animation::Target {
                    extensions: None,
                    extras: Default::default(),
                    node,
                    path: Valid(json::animation::Property::MorphTargetWeights),
                },
                extensions: None,
                extras: Default::default(),
            },
            json::animation::Sampler {
                extensions: None,
                extras: Default::default(),
                input,
                interpolation: Valid(json::animation::Interpolation::Linear),
                output,
            },
        ))
    }

    /// Header, JSON chunk padded with spaces, binary chunk padded with zeros.
    fn finish(mut self) -> Result<Vec<u8>> {
        let fail = |e: &dyn std::fmt::Display| Error::io(format!("glTF: {e}"));
        if !self.bytes.is_empty() {
            self.root.push(json::Buffer {
                byte_length: USize64::from(self.bytes.len()),
                extensions: None,
                extras: Default::default(),
                name: None,
                uri: None,
            });
        }
        self.root.asset.generator = Some(format!("toile {}", env!("CARGO_PKG_VERSION")));
        let mut text = self.root.to_vec().map_err(|e| fail(&e))?;
        text.resize(text.len().next_multiple_of(4), b' ');
        let chunk = if self.bytes.is_empty() { 0 } else { 8 };
        let total = 12 + 8 + text.len() + chunk + self.bytes.len();
        let size = |n: usize| u32::try_from(n).map_err(|_| fail(&"file above 4 GiB"));
        let mut out = Vec::with_capacity(total);
        out.extend_from_slice(b"glTF");
        out.extend_from_slice(&2_u32.to_le_bytes());
        out.extend_from_slice(&size(total)?.to_le_bytes());
        out.extend_from_slice(&size(text.len())?.to_le_bytes());
        out.extend_from_slice(b"JSON");
        out.extend_from_slice(&text);
        if chunk > 0 {
            out.extend_from_slice(&size(self.bytes.len())?.to_le_bytes());
            out.extend_from_slice(b"BIN\0");
            out.extend_from_slice(&self.bytes);
        }
        Ok(out)
    }
}

/// Normal of a vertex that has none: the format asks for unit length.
const UP: &Vec3 = &Vec3::new(0.0, 1.0, 0.0);

#[cfg(test)]
mod tests {
    use super::*;
    use json::validation::Validate;

    fn part() -> Part {
        Part::garment(
            "cloth",
            &[
                Vec3::zeros(),
                Vec3::x(),
                Vec3::y(),
                Vec3::new(1.0, 1.0, 0.5),
            ],
            &[[0, 1, 2], [1, 3, 2]],
            &[0, 0, 1, 1],
        )
    }

    fn parse(bytes: &[u8]) -> (Root, usize) {
        let word = |i: usize| u32::from_le_bytes(bytes[i..i + 4].try_into().unwrap()) as usize;
        assert_eq!(&bytes[..4], b"glTF");
        assert_eq!(word(8), bytes.len());
        let n = word(12);
        let root = Root::from_slice(&bytes[20..20 + n]).unwrap();
        assert_eq!(word(20 + n), bytes.len() - 28 - n);
        (root, word(20 + n))
    }

    #[test]
    fn the_file_is_valid_gltf_and_every_accessor_lies_in_the_buffer() {
        let frames = vec![part().positions, part().positions];
        let motions = [0, 1].map(|part| Animation {
            part,
            times: &[0.0, 0.5],
            frames: &frames,
        });
        let (root, size) = parse(&to_glb(&[part(), part()], &motions).unwrap());
        let mut problems = Vec::new();
        root.validate(&root, json::Path::new, &mut |path, e| {
            problems.push(format!("{} {e}", path()));
        });
        assert!(problems.is_empty(), "{problems:?}");
        for view in &root.buffer_views {
            let end = view.byte_offset.unwrap().0 + view.byte_length.0;
            assert!(end as usize <= size && view.byte_offset.unwrap().0 % 4 == 0);
        }
        assert_eq!(root.accessors[0].count.0, 4);
        assert_eq!(
            root.accessors[0].max,
            Some(serde_json::json!([1.0, 1.0, 0.5]))
        );
        assert_eq!(root.animations.len(), 1);
        for (i, channel) in root.animations[0].channels.iter().enumerate() {
            assert_eq!(channel.sampler.value(), i);
            assert_eq!(channel.target.node.value(), i);
        }
    }

    #[test]
    fn nothing_to_show_is_still_a_file() {
        let bytes = to_glb(&[], &[]).unwrap();
        assert_eq!(&bytes[..4], b"glTF");
        let mut bad = part();
        bad.colours.pop();
        assert!(to_glb(&[bad], &[]).is_err());
    }
}
