//! Node transforms and the axis conversion, as column-vector matrices in `f64`.

use super::document::{Document, Node, clip};
use crate::error::Result;
use glam::{DMat4, DVec3};

/// The rotation from the file's axes to +y up.
///
/// # Errors
///
/// An `<up_axis>` that is none of COLLADA's three.
pub(super) fn up_axis(document: &Document<'_>) -> Result<DMat4> {
    let Some(element) = document.descend(document.root(), &["asset", "up_axis"]) else { return Ok(DMat4::IDENTITY) };
    match document.words(element).next().unwrap_or("") {
        "Y_UP" => Ok(DMat4::IDENTITY),
        "Z_UP" => Ok(rows([[-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0]])),
        "X_UP" => Ok(rows([[0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])),
        other => Err(document.expected(element, format!("up axis \"{}\"", clip(other)), "X_UP, Y_UP or Z_UP")),
    }
}

/// A node's own transform: the product of its transform elements in document order.
///
/// # Errors
///
/// Malformed numbers, a matrix with perspective, a degenerate `lookat`, and `skew`, which is not supported.
pub(super) fn local<'a>(document: &Document<'a>, node: Node<'a>) -> Result<DMat4> {
    let mut matrix = DMat4::IDENTITY;
    for child in node.children().filter(|child| child.is_element()) {
        let step = match child.tag_name().name() {
            "matrix" => affine(document, child)?,
            "translate" => DMat4::from_translation(DVec3::from(document.floats::<3>(child)?)),
            "rotate" => rotation(document, child)?,
            "scale" => DMat4::from_scale(DVec3::from(document.floats::<3>(child)?)),
            "lookat" => look_at(document, child)?,
            "skew" => {
                return Err(document.expected(child, "<skew> is not supported", "the same transform as a <matrix>"));
            }
            _ => continue,
        };
        matrix *= step;
    }
    Ok(matrix)
}

/// `<matrix>`: sixteen numbers, row by row.
fn affine<'a>(document: &Document<'a>, element: Node<'a>) -> Result<DMat4> {
    let matrix = DMat4::from_cols_array(&document.floats::<16>(element)?).transpose();
    if matrix.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
        return Err(document.expected(element, "a <matrix> with perspective", "0 0 0 1 as its last row"));
    }
    Ok(matrix)
}

/// `<rotate>`: an axis and an angle in degrees.
fn rotation<'a>(document: &Document<'a>, element: Node<'a>) -> Result<DMat4> {
    let [x, y, z, degrees] = document.floats::<4>(element)?;
    match DVec3::new(x, y, z).try_normalize() {
        Some(axis) => Ok(DMat4::from_axis_angle(axis, degrees.to_radians())),
        None if degrees == 0.0 => Ok(DMat4::IDENTITY),
        None => Err(document.expected(element, "a <rotate> about the axis 0 0 0", "an axis and an angle in degrees")),
    }
}

/// `<lookat>`: puts the frame at the eye, its −z towards the point of interest, its +y roughly up.
fn look_at<'a>(document: &Document<'a>, element: Node<'a>) -> Result<DMat4> {
    let [ex, ey, ez, ix, iy, iz, ux, uy, uz] = document.floats::<9>(element)?;
    let (eye, interest, up) = (DVec3::new(ex, ey, ez), DVec3::new(ix, iy, iz), DVec3::new(ux, uy, uz));
    let frame = (interest - eye).try_normalize().and_then(|forward| {
        let right = forward.cross(up).try_normalize()?;
        let columns = [right, right.cross(forward), -forward].map(|column| column.extend(0.0));
        Some(DMat4::from_cols(columns[0], columns[1], columns[2], eye.extend(1.0)))
    });
    frame.ok_or_else(|| {
        let expected = "eye and interest that differ, and an up vector that is not parallel to the view";
        document.expected(element, "a <lookat> that defines no frame", expected)
    })
}

fn rows(rows: [[f64; 4]; 3]) -> DMat4 {
    DMat4::from_cols_array_2d(&[rows[0], rows[1], rows[2], [0.0, 0.0, 0.0, 1.0]]).transpose()
}
