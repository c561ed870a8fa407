//! `<camera>` elements with a perspective lens.

use super::document::{Document, Node};
use crate::error::Result;
use crate::scene::description::CameraDescription;
use glam::{DMat4, DVec3};

/// Widest aspect ratio that is taken seriously.
const MAX_ASPECT: f64 = 1e6;

/// The camera that `instance` puts into `node`, with the `<perspective>` element `lens`.
pub(super) fn read<'a>(
    document: &Document<'a>,
    lens: Node<'a>,
    node: Node<'a>,
    instance: Node<'a>,
    to_world: DMat4,
) -> Result<CameraDescription> {
    let between = |name: &str, low: f64, high: f64| -> Result<Option<f64>> {
        let Some(element) = document.child(lens, name) else { return Ok(None) };
        let value = document.float(element)?;
        if value > low && value < high {
            return Ok(Some(value));
        }
        Err(document.expected(element, format!("<{name}> of {value}"), format!("above {low} and below {high}")))
    };
    let name = document.name(node);
    if !to_world.is_finite() {
        let what = format!("the transform of node {name} takes its camera beyond the range of numbers");
        return Err(document.expected(instance, what, "a finite transform"));
    }
    Ok(CameraDescription {
        name,
        to_world,
        origin: DVec3::ZERO,
        xfov: between("xfov", 0.0, 180.0)?,
        yfov: between("yfov", 0.0, 180.0)?,
        aspect_ratio: between("aspect_ratio", 0.0, MAX_ASPECT)?,
    })
}
