//! The distance of a hit, against the plane's equation in twice the precision.

use etendue_math::Vec3;

use super::super::block::longest_side;
use super::meshes::{rays, soup};

/// A number in double-double, exact to about 2⁻¹⁰⁰: the oracle of the next test.
#[derive(Clone, Copy)]
struct Double(f64, f64);

impl Double {
    fn sum(a: f64, b: f64) -> Self {
        let s = a + b;
        let r = s - a;
        Self(s, (a - (s - r)) + (b - r))
    }
    fn add(self, o: Self) -> Self {
        let (s, t) = (Self::sum(self.0, o.0), Self::sum(self.1, o.1));
        let s = Self::sum(s.0, s.1 + t.0);
        Self::sum(s.0, s.1 + t.1)
    }
    fn times(self, o: Self) -> Self {
        let p = self.0 * o.0;
        Self::sum(p, self.0.mul_add(o.0, -p) + (self.0 * o.1 + self.1 * o.0))
    }
    fn minus(self) -> Self {
        Self(-self.0, -self.1)
    }
}

fn difference(a: Vec3, b: Vec3) -> [Double; 3] {
    [Double::sum(a.x, -b.x), Double::sum(a.y, -b.y), Double::sum(a.z, -b.z)]
}

fn dot(a: [Double; 3], b: [Double; 3]) -> Double {
    a[0].times(b[0]).add(a[1].times(b[1])).add(a[2].times(b[2]))
}

#[test]
fn the_distance_is_that_of_the_plane_within_what_rounding_allows() {
    // With D the distance of the farthest vertex, s the longest side, A the area, c = |n·d| and ε = 2⁻⁵³: vertices come
    // out of the shear wrong by up to 6 ε (D + s) across the ray, which the plane's slope makes up to that over c along it;
    // weights that err by 96 s² ε / (2 A c) together move the depth by half a side times that, and t by up to √3 times
    // the depth (see `MARGIN`); the last operations add 8 ε D.
    let mut worst = 0.0_f64;
    for scale in [1.0, 1e-8, 1e8] {
        let mesh = soup(scale);
        for (o, d) in rays(&mesh, 18_000) {
            let Some(hit) = mesh.nearest(o, d, f64::INFINITY, &[]) else {
                continue;
            };
            let [a, b, c] = mesh.triangle(hit.triangle);
            let (e, f) = (difference(b, a), difference(c, a));
            let minor = |i: usize, j: usize| e[i].times(f[j]).add(e[j].times(f[i]).minus());
            let n = [minor(1, 2), minor(2, 0), minor(0, 1)];
            let (above, below) = (dot(n, difference(a, o)), dot(n, difference(d, Vec3::default())));
            let error = Double(hit.t, 0.0).times(below).add(above.minus()).0 / below.0;
            let (far, side) = (
                [a, b, c].iter().fold(0.0_f64, |m, p| m.max((*p - o).length())),
                longest_side([a, b, c]),
            );
            let double_area = n.iter().fold(0.0, |sum, n| sum + n.0 * n.0).sqrt();
            let slope = below.0.abs() / double_area;
            let eps = f64::EPSILON / 2.0;
            // A triangle that is `THIN` has exact weights.
            let weights = (84.0 * side * side / (double_area * slope)).min(84.0 * f64::from(1 << 20));
            let bound = eps * (12.0 * (far + side) / slope + weights * side + 8.0 * far);
            worst = worst.max(error.abs() / bound);
            assert!(error.abs() <= bound, "{error} {bound} {hit:?}");
        }
    }
    // The bound is of the right size, not just large.
    assert!(worst > 0.01, "{worst}");
}
