//! Putting local geometry into the world: positions, normals and winding.

use glam::{DMat3, DMat4, DVec3, Vec3};

/// Relative deviation that still counts as a uniform scale: files state matrices to six or seven digits.
const UNIFORM_TOLERANCE: f64 = 1e-4;

/// A local-to-world matrix with what follows from it.
pub(super) struct Placement {
    to_world: DMat4,
    /// The inverse transpose up to a positive factor; also defined where the matrix is singular.
    normals: DMat3,
    /// Left and right are swapped: triangles have to be wound the other way.
    pub mirrored: bool,
}

impl Placement {
    /// For an affine `to_world`.
    pub fn new(to_world: DMat4) -> Self {
        let linear = DMat3::from_mat4(to_world);
        // Scaled to about 1 so that cofactors of extreme matrices neither overflow nor vanish.
        let largest = linear.to_cols_array().iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let linear = if largest > 0.0 && largest.is_finite() { linear * largest.recip() } else { linear };
        let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let mirrored = x.dot(y.cross(z)) < 0.0;
        Placement { to_world, normals: if mirrored { -cofactors } else { cofactors }, mirrored }
    }

    /// A position in the world, rounded once; nothing if it is not finite.
    pub fn position(&self, local: DVec3) -> Option<Vec3> {
        let world = self.in_double(local).as_vec3();
        world.is_finite().then_some(world)
    }

    /// A position in the world, not rounded to single precision.
    pub fn in_double(&self, local: DVec3) -> DVec3 {
        self.to_world.transform_point3(local)
    }

    /// A unit normal in the world; zero, which means "flat here", if there is none.
    pub fn normal(&self, local: DVec3) -> Vec3 {
        let unit = local.try_normalize().and_then(|local| (self.normals * local).try_normalize());
        unit.map_or(Vec3::ZERO, |normal| normal.as_vec3())
    }

    /// The factor of a uniform scale; nothing if lengths change with direction.
    pub fn uniform_scale(&self) -> Option<f64> {
        let linear = DMat3::from_mat4(self.to_world);
        let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
        let scale = (x.length() + y.length() + z.length()) / 3.0;
        let unequal = [x, y, z].iter().map(|axis| (axis.length() - scale).abs() / scale).fold(0.0, f64::max);
        let skewed = [x.dot(y), y.dot(z), z.dot(x)].iter().map(|dot| dot.abs() / (scale * scale)).fold(0.0, f64::max);
        (scale > 0.0 && unequal <= UNIFORM_TOLERANCE && skewed <= UNIFORM_TOLERANCE).then_some(scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stay_perpendicular_and_outside() {
        let shear = DMat4::from_cols_array_2d(&[
            [2.0, 0.5, 0.0, 0.0],
            [0.0, 1.0, 0.3, 0.0],
            [0.7, 0.0, 3.0, 0.0],
            [5.0, 6.0, 7.0, 1.0],
        ]);
        for matrix in [shear, shear * DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0))] {
            let placement = Placement::new(matrix);
            let (edge1, edge2) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 0.5, 1.0));
            let normal = placement.normal(edge1.cross(edge2)).as_dvec3();
            let (world1, world2) = (matrix.transform_vector3(edge1), matrix.transform_vector3(edge2));
            let geometric = if placement.mirrored { world2.cross(world1) } else { world1.cross(world2) };
            assert!((normal - geometric.normalize()).length() < 1e-6);
        }
        assert!(Placement::new(DMat4::from_scale(DVec3::new(1.0, -1.0, 1.0))).mirrored);
    }

    #[test]
    fn no_normal_is_zero_and_overflow_is_no_position() {
        let placement = Placement::new(DMat4::from_scale(DVec3::splat(1e200)));
        assert_eq!(placement.normal(DVec3::ZERO), Vec3::ZERO);
        assert_eq!(placement.normal(DVec3::NAN), Vec3::ZERO);
        assert_eq!(placement.normal(DVec3::new(0.0, 5.0, 0.0)), Vec3::Y);
        assert_eq!(placement.position(DVec3::ONE), None);
        let flat = Placement::new(DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0)));
        assert_eq!(flat.normal(DVec3::Z), Vec3::Z);
    }

    #[test]
    fn only_uniform_scales_keep_a_sphere() {
        let turned = DMat4::from_rotation_x(0.7) * DMat4::from_scale(DVec3::new(2.0, -2.0, 2.0));
        assert!((Placement::new(turned).uniform_scale().unwrap() - 2.0).abs() < 1e-9);
        for matrix in [
            DMat4::from_scale(DVec3::new(1.0, 1.0, 1.1)),
            DMat4::ZERO,
            DMat4::from_scale(DVec3::splat(f64::NAN)),
            DMat4::from_scale(DVec3::new(1.0, 2.0, 1.0)) * DMat4::from_rotation_z(std::f64::consts::FRAC_PI_4),
        ] {
            assert_eq!(Placement::new(matrix).uniform_scale(), None);
        }
    }
}
