//! Which camera a render uses, of all that the command line, the scene and its stage offer.

use super::load::Staged;
use super::resolve::{Framing, ViewRequest};
use crate::error::{Error, Result};
use crate::options::RenderOptions;
use crate::scene::bounds::geometry_bounds;
use crate::scene::camera::Camera;
use crate::scene::viewpoint::{self, CameraChoice, Explicit};
use glam::DVec3;

/// The camera that `view` asks for.
pub fn resolve(view: &ViewRequest, staged: &Staged, options: &RenderOptions) -> Result<Camera> {
    let description = &staged.description;
    let (min, max) = geometry_bounds(description)
        .ok_or_else(|| Error::Scene(format!("{}: there is no geometry to look at", description.name)))?;
    let framing = framing(view, staged, options, min, max)?;
    if view.explicit == Explicit::default() {
        return Ok(framing);
    }
    let around = |point: Option<DVec3>| point.map(|point| point - description.origin);
    let Explicit { position, target, .. } = view.explicit;
    let explicit = Explicit { position: around(position), target: around(target), ..view.explicit };
    viewpoint::explicit(&explicit, &framing, (min + max) * 0.5).map_err(Error::Options)
}

/// The camera before the command line changes it, for geometry in the box from `min` to `max`.
fn framing(view: &ViewRequest, staged: &Staged, options: &RenderOptions, min: DVec3, max: DVec3) -> Result<Camera> {
    let description = &staged.description;
    let choose = |choice| {
        viewpoint::choose(choice, description.camera.as_ref(), min, max, options.width, options.height)
            .map_err(|why| format!("{}: {why}", description.name))
    };
    match (&view.framing, staged.camera) {
        (Framing::Settings { camera, position }, _) => Ok(camera.at(*position - description.origin)),
        (Framing::Choice(choice), _) => choose(*choice).map_err(Error::Options),
        (Framing::Scene, Some(camera)) => Ok(camera),
        (Framing::Scene, None) if description.course_profile => choose(CameraChoice::Course).map_err(Error::Scene),
        (Framing::Scene, None) => choose(CameraChoice::File).map_err(Error::Scene),
    }
}
