//! Triangles of one primitive (\[glTF\] 3.7.2, "Meshes").

use super::accessor::{Accessor, QUANTIZED, SIGNED};
use super::budget::{Budget, reserve};
use super::buffer::Buffers;
use super::document::Document;
use super::error::{GltfError, Object};
use crate::scene::description::MeshDescription;
use glam::{DVec3, Vec3};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};
use std::collections::HashMap;

/// A primitive of a mesh.
pub(super) struct Part<'a> {
    pub(super) primitive: &'a Primitive,
    /// Which of the mesh's.
    pub(super) number: usize,
    /// Of texture coordinates that its material needs.
    pub(super) set: Option<u32>,
}

/// Converts a part of the mesh `object`; `None`, with a warning, if it has no
/// triangles.
pub(super) fn convert(
    document: &Document,
    buffers: &Buffers,
    &Part { primitive, number, set }: &Part,
    object: &Object,
    budget: &mut Budget,
    warnings: &mut Vec<String>,
) -> Result<Option<MeshDescription>, GltfError> {
    let field = |name: &str| format!("primitives[{number}].{name}");
    let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
    let mut warn = |what: &str| warnings.push(format!("{object}: {what}"));

    let mode = match primitive.mode {
        Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
        Checked::Valid(mode) => {
            warn(&format!("{} {mode:?} is skipped, only triangles are rendered", field("mode")));
            return Ok(None);
        }
        Checked::Invalid => {
            let mesh = object.index.unwrap_or_default();
            let value = document.literal(&format!("/meshes/{mesh}/primitives/{number}/mode"));
            return Err(object.invalid(field("mode"), value, "expected 0 to 6"));
        }
    };
    let Some(positions) = attribute(Semantic::Positions) else {
        warn(&format!("primitives[{number}] has no POSITION and is skipped"));
        return Ok(None);
    };
    let empty = |index| document.root.get(index).is_some_and(|accessor: &json::Accessor| accessor.count.0 == 0);
    if empty(positions) || primitive.indices.is_some_and(empty) {
        warn(&format!("primitives[{number}] has no triangle and is skipped"));
        return Ok(None);
    }
    if attribute(Semantic::Colors(0)).is_some() {
        warn(&format!("{} is ignored", field("attributes.COLOR_0")));
    }
    if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
        warn(&format!("{} (morph targets) are ignored", field("targets")));
    }

    let name = field("attributes.POSITION");
    let positions = Accessor::of_vectors(document, buffers, positions, object, &name, &QUANTIZED)?;
    let normals = match attribute(Semantic::Normals) {
        Some(index) => {
            let normals = Accessor::of_vectors(document, buffers, index, object, &field("attributes.NORMAL"), &SIGNED)?;
            if normals.count != positions.count {
                let expected = format!("its POSITION has {}", positions.count);
                return Err(normals.object.invalid("count", normals.count, expected));
            }
            Some(normals)
        }
        None => None,
    };
    let field_of_set = field(&format!("attributes.TEXCOORD_{}", set.unwrap_or_default()));
    let coordinates = match coordinates(primitive, set) {
        Some(index) => {
            let coordinates = Accessor::of_coordinates(document, buffers, index, object, &field_of_set)?;
            if coordinates.count != positions.count {
                let expected = format!("its POSITION has {}", positions.count);
                return Err(coordinates.object.invalid("count", coordinates.count, expected));
            }
            Some(coordinates)
        }
        None => None,
    };
    let indices = match primitive.indices {
        Some(index) => Some(Accessor::of_indices(document, buffers, index, object)?),
        None => None,
    };

    let corner_count = indices.as_ref().map_or(positions.count, |indices| indices.count);
    budget.charge(corner_count, 2 * size_of::<u32>(), object)?;
    let mut corners: Vec<u32> = reserve(corner_count, object)?;
    match &indices {
        Some(indices) => {
            for i in 0..corner_count {
                let vertex = indices.index(i);
                if vertex as usize >= positions.count {
                    let expected = format!("its primitive has {} vertices", positions.count);
                    return Err(indices.object.invalid(format!("[{i}]"), vertex, expected));
                }
                corners.push(vertex);
            }
        }
        // `count` of an accessor fits 32 bits.
        None => corners.extend(0..corner_count as u32),
    }

    let used = compact(&mut corners, positions.count, object)?;
    let vertex_count = used.as_ref().map_or(positions.count, Vec::len);
    let vertices = Vertices { used: &used, count: vertex_count, object };

    if mode == Mode::Triangles && !corners.len().is_multiple_of(3) {
        warn(&format!(
            "primitives[{number}] has {} vertices, the last {} are left out",
            corners.len(),
            corners.len() % 3
        ));
    }
    let triangle_count = if mode == Mode::Triangles { corners.len() / 3 } else { corners.len().saturating_sub(2) };
    budget.charge(triangle_count, size_of::<[u32; 3]>(), object)?;
    let mut triangles = reserve(triangle_count, object)?;
    triangles.extend(assemble(mode, &corners));
    if triangles.is_empty() {
        warn(&format!("primitives[{number}] has no triangle and is skipped"));
        return Ok(None);
    }
    let positions = vertices.gather(|i| positions.vector(i), budget)?;
    let mut normals = match normals {
        Some(normals) => vertices.gather(|i| normals.vector(i), budget)?,
        None => Vec::new(),
    };
    let mut texture_coordinates = match coordinates {
        Some(coordinates) => vertices.gather(|i| coordinates.vector(i), budget)?,
        None => Vec::new(),
    };
    let replaced = replace_unusable(&mut normals, &positions, &triangles);
    if replaced > 0 {
        let name = field("attributes.NORMAL");
        warn(&format!("{name}: {replaced} of length 0 or not finite are replaced by those of the faces around"));
    }
    let lost = texture_coordinates.iter_mut().filter(|c| !(c[0].is_finite() && c[1].is_finite()));
    let lost = lost.map(|c| *c = [0.0; 2]).count();
    if lost > 0 {
        warn(&format!("{field_of_set}: {lost} not finite are taken as 0"));
    }
    Ok(Some(MeshDescription {
        name: format!("{}[{number}]", object.label()),
        positions,
        normals,
        texture_coordinates,
        triangles,
    }))
}

/// Texture coordinates of a set that are read.
pub(super) fn coordinates(primitive: &Primitive, set: Option<u32>) -> Option<Index<json::Accessor>> {
    primitive.attributes.get(&Checked::Valid(Semantic::TexCoords(set?))).copied()
}

/// The vertices that are read.
struct Vertices<'a> {
    /// `None` for all.
    used: &'a Option<Vec<u32>>,
    count: usize,
    object: &'a Object,
}

impl Vertices<'_> {
    fn gather<T>(&self, read: impl Fn(usize) -> T, budget: &mut Budget) -> Result<Vec<T>, GltfError> {
        budget.charge(self.count, size_of::<T>(), self.object)?;
        let mut list = reserve(self.count, self.object)?;
        match self.used {
            Some(used) => list.extend(used.iter().map(|&i| read(i as usize))),
            None => list.extend((0..self.count).map(read)),
        }
        Ok(list)
    }
}

/// Leaves out the vertices that no corner names, in which case it returns the others: writers share one vertex buffer
/// among many primitives, and what is far from all triangles would widen every bound.
fn compact(corners: &mut [u32], count: usize, object: &Object) -> Result<Option<Vec<u32>>, GltfError> {
    let used = if corners.len() < count {
        let mut used = reserve(corners.len(), object)?;
        used.extend_from_slice(corners);
        used.sort_unstable();
        used.dedup();
        used
    } else {
        let mut is_used = reserve(count, object)?;
        is_used.resize(count, false);
        for &corner in corners.iter() {
            is_used[corner as usize] = true;
        }
        let number = is_used.iter().filter(|used| **used).count();
        if number == count {
            return Ok(None);
        }
        let mut used = reserve(number, object)?;
        // `count` of an accessor fits 32 bits.
        used.extend((0..count as u32).filter(|&vertex| is_used[vertex as usize]));
        used
    };
    for corner in corners {
        *corner = used.partition_point(|&vertex| vertex < *corner) as u32;
    }
    Ok(Some(used))
}

/// Normals without a direction, as modellers leave them at faces without area, become the mean of the faces around,
/// weighted by area, or +y where that has none either. Returns their number.
fn replace_unusable(normals: &mut [[f32; 3]], positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> usize {
    let usable = |n: &[f32; 3]| {
        let n = Vec3::from(*n);
        n.is_finite() && n != Vec3::ZERO
    };
    let unusable: Vec<usize> = (0..normals.len()).filter(|&i| !usable(&normals[i])).collect();
    if unusable.is_empty() {
        return 0;
    }
    let mut sums: HashMap<usize, DVec3> = unusable.iter().map(|&i| (i, DVec3::ZERO)).collect();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| Vec3::from(positions[v as usize]).as_dvec3());
        for vertex in triangle {
            if let Some(sum) = sums.get_mut(&(*vertex as usize)) {
                *sum += (b - a).cross(c - a);
            }
        }
    }
    for (vertex, sum) in sums {
        normals[vertex] = sum.try_normalize().unwrap_or(DVec3::Y).as_vec3().to_array();
    }
    unusable.len()
}

/// Triangles of a list of corners, counter-clockwise, in the order of \[glTF\] 3.7.2.1.
///
/// Strips and fans repeat a corner to begin anew elsewhere: such triangles are left out.
fn assemble(mode: Mode, corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let list = mode == Mode::Triangles;
    let count = if list { corners.len() / 3 } else { corners.len().saturating_sub(2) };
    let triangles = (0..count).map(move |i| match mode {
        Mode::TriangleStrip => [corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]],
        Mode::TriangleFan => [corners[i + 1], corners[i + 2], corners[0]],
        _ => [corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]],
    });
    triangles.filter(move |[a, b, c]| list || (a != b && b != c && c != a))
}
