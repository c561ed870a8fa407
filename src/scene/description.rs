//! What an importer hands over: a scene in plain vectors, world space, before anything is built.
//!
//! Frame: right-handed, **+y up**, whatever unit the file uses. Importers convert axes and bake node
//! transforms (in `f64`, rounded once). Triangles wind counter-clockwise seen from their front.

use crate::error::{At, Note};
use glam::{DMat4, DVec3, Vec3};

/// A scene as read from a file or made by a generator.
#[derive(Clone, Debug, Default)]
pub struct SceneDescription {
    /// What to call it: a file name or a generator's specification.
    pub name: String,
    /// What was subtracted from every position before it was rounded, world space; zero for most.
    pub origin: DVec3,
    /// Triangle meshes.
    pub meshes: Vec<MeshDescription>,
    /// Analytic spheres.
    pub spheres: Vec<SphereDescription>,
    /// The materials that meshes and spheres point to by index.
    pub materials: Vec<MaterialDescription>,
    /// Parallelogram lights that exist apart from any mesh.
    pub area_lights: Vec<AreaLightDescription>,
    /// The file's camera, if it has one.
    pub camera: Option<CameraDescription>,
    /// The file carries the course's `<extra>` profile (`CGL` or `CMU462`): its camera is placed the course's way.
    pub course_profile: bool,
    /// What the user should know.
    pub notes: Vec<Note>,
}

/// A triangle mesh in world space.
#[derive(Clone, Debug, Default)]
pub struct MeshDescription {
    /// Node or group name, for messages.
    pub name: String,
    /// Where it stands in its file.
    pub at: At,
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// The positions in double precision, if that was asked for and the source knows more than single precision holds; else empty.
    pub double: Vec<DVec3>,
    /// Unit vertex normals, one a position, or empty.
    pub normals: Vec<Vec3>,
    /// Three vertex indices a triangle, each below `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`SceneDescription::materials`].
    pub material: u32,
}

impl MeshDescription {
    /// A vertex position, as exactly as it is known.
    pub fn position(&self, vertex: u32) -> DVec3 {
        let vertex = vertex as usize;
        self.double.get(vertex).copied().unwrap_or_else(|| self.positions[vertex].as_dvec3())
    }
}

/// A sphere in world space.
#[derive(Clone, Debug)]
pub struct SphereDescription {
    /// Node name, for messages.
    pub name: String,
    /// Where it stands in its file.
    pub at: At,
    /// Centre.
    pub center: Vec3,
    /// Radius, above 0.
    pub radius: f32,
    /// Centre and radius in double precision, as [`MeshDescription::double`].
    pub double: Option<(DVec3, f64)>,
    /// Index into [`SceneDescription::materials`].
    pub material: u32,
}

/// A material as the file states it, rendered or not.
#[derive(Clone, Debug)]
pub struct MaterialDescription {
    /// Its name in the file.
    pub name: String,
    /// Where it stands in its file.
    pub at: At,
    /// How it scatters.
    pub surface: Surface,
    /// Emitted radiance (linear Rec. 709, W·sr⁻¹·m⁻²) from the front of the surface; zero for most.
    pub emission: Vec3,
}

/// How a surface scatters light.
#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// Lambertian, both sides.
    Diffuse {
        /// Albedo, linear Rec. 709.
        albedo: Vec3,
    },
    /// Perfect mirror.
    Mirror {
        /// Reflectance.
        reflectance: Vec3,
    },
    /// Smooth dielectric that only refracts.
    Refraction {
        /// Transmittance.
        transmittance: Vec3,
        /// Index of refraction.
        ior: f32,
    },
    /// Smooth dielectric.
    Glass {
        /// Reflectance.
        reflectance: Vec3,
        /// Transmittance.
        transmittance: Vec3,
        /// Index of refraction.
        ior: f32,
    },
    /// Rough conductor.
    Microfacet {
        /// Roughness α.
        alpha: f32,
        /// Refractive index, real part, a colour channel.
        eta: Vec3,
        /// Refractive index, imaginary part, a colour channel.
        k: Vec3,
    },
}

impl Surface {
    /// The word for it in messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Surface::Diffuse { .. } => "diffuse",
            Surface::Mirror { .. } => "mirror",
            Surface::Refraction { .. } => "refraction",
            Surface::Glass { .. } => "glass",
            Surface::Microfacet { .. } => "microfacet",
        }
    }
}

/// A parallelogram that emits from one side: the course's `area` light.
#[derive(Clone, Debug)]
pub struct AreaLightDescription {
    /// Node name, for messages.
    pub name: String,
    /// Where it stands in its file.
    pub at: At,
    /// Centre.
    pub center: Vec3,
    /// The centre in double precision, as [`MeshDescription::double`].
    pub double: Option<DVec3>,
    /// Full side, first.
    pub side_u: Vec3,
    /// Full side, second.
    pub side_v: Vec3,
    /// The direction it emits to (need not be unit length nor exactly perpendicular: it picks the side).
    pub direction: Vec3,
    /// Emitted radiance.
    pub radiance: Vec3,
}

/// A camera node as COLLADA has it, after the axis conversion: looks along −z of its frame, +y up.
#[derive(Clone, Debug)]
pub struct CameraDescription {
    /// Node name, for messages.
    pub name: String,
    /// Camera to world, less [`SceneDescription::origin`].
    pub to_world: DMat4,
    /// [`SceneDescription::origin`].
    pub origin: DVec3,
    /// Horizontal field of view in degrees, if stated.
    pub xfov: Option<f64>,
    /// Vertical field of view in degrees, if stated.
    pub yfov: Option<f64>,
    /// Width by height, if stated.
    pub aspect_ratio: Option<f64>,
}
