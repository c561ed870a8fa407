//! `<light>` elements: the course's area lights, and lights without extent.

use super::document::{Document, Node, clip, is_course_technique};
use super::lamps::Lamp;
use crate::error::Result;
use crate::scene::description::AreaLightDescription;
use glam::{DMat4, DVec3};

/// A light in the world.
pub(super) enum Light {
    /// With a shape of its own.
    Area(AreaLightDescription),
    /// Without one.
    Lamp(Lamp),
}

/// The light that `instance` puts into `node`.
///
/// An area light spans the full sides x and y of its frame about the origin and emits towards −z.
pub(super) fn read<'a>(
    document: &Document<'a>,
    light: Node<'a>,
    node: Node<'a>,
    instance: Node<'a>,
    to_world: DMat4,
) -> Result<Light> {
    let position = to_world.transform_point3(DVec3::ZERO);
    let name = document.name(node);
    let extras = document.children(light, "extra").flat_map(|extra| document.children(extra, "technique"));
    let area = extras.filter(|node| is_course_technique(*node)).find_map(|node| document.child(node, "area"));
    let Some(area) = area else {
        let common = document.child(light, "technique_common");
        let shape = common.and_then(|common| common.children().find(|child| child.is_element()));
        let kind = shape.map_or_else(|| "unspecified".to_string(), |shape| clip(shape.tag_name().name()));
        let (light, line) = (document.name(light), document.line(instance));
        return Ok(Light::Lamp(Lamp { light, node: name, kind, line, position }));
    };
    let radiance = document.color(document.required(area, "color")?)?;
    let center = position.as_vec3();
    let [side_u, side_v, direction] =
        [DVec3::X, DVec3::Y, DVec3::NEG_Z].map(|local| to_world.transform_vector3(local).as_vec3());
    let volume = side_u.as_dvec3().cross(side_v.as_dvec3()).dot(direction.as_dvec3());
    if !(center.is_finite() && volume.is_finite() && volume != 0.0) {
        let what = format!("the transform of node {name} leaves its area light without area or direction");
        return Err(document.expected(instance, what, "a transform that can be inverted"));
    }
    let at = document.at(instance);
    Ok(Light::Area(AreaLightDescription { name, at, center, double: None, side_u, side_v, direction, radiance }))
}
