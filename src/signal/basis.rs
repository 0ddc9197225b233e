//! Bases of lattices.

/// A displacement: pixels to the right and downwards.
pub type Vector = [f64; 2];

/// Two displacements that span a lattice.
pub type Basis = [Vector; 2];

/// The scalar product.
pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// `a` times the first vector and `b` times the second.
pub fn combined(basis: Basis, a: f64, b: f64) -> Vector {
    [a * basis[0][0] + b * basis[1][0], a * basis[0][1] + b * basis[1][1]]
}

/// Area of the cell, in square pixels; never negative.
pub fn area(basis: Basis) -> f64 {
    (basis[0][0] * basis[1][1] - basis[0][1] * basis[1][0]).abs()
}

/// The dual basis: the products of its vectors with a displacement are the displacement's
/// [`coefficients`]. `None` if the vectors are parallel.
pub fn dual([[ax, ay], [bx, by]]: Basis) -> Option<Basis> {
    let area = ax * by - ay * bx;
    (area.abs() > 1e-9).then(|| [[by / area, -bx / area], [-ay / area, ax / area]])
}

/// The coefficients of a displacement: what [`combined`] makes it of.
pub fn coefficients(basis: Basis, v: Vector) -> Vector {
    let [u, w] = basis;
    let det = u[0] * w[1] - u[1] * w[0];
    [(v[0] * w[1] - v[1] * w[0]) / det, (u[0] * v[1] - u[1] * v[0]) / det]
}

/// Of a vector and its negative, the one that points from 70 degrees above the right to 110 degrees
/// below it.
///
/// Where the convention turns over, the vector changes with noise. Lattices in photographs mostly
/// have vectors near the axes, at 45 and at 60 degrees; these keep away from it.
pub fn directed(v: Vector) -> Vector {
    // Cosine and sine of 20 degrees, the middle of the range.
    let ahead = 0.939_692_620_785_908_4 * v[0] + 0.342_020_143_325_668_7 * v[1];
    if ahead < 0.0 { [-v[0], -v[1]] } else { v }
}

/// The reduced basis of the same lattice (Lagrange and Gauss): the shortest displacement, then the
/// shortest that is no multiple of it; each [`directed`].
pub fn reduced(basis: Basis) -> Basis {
    let [mut short, mut long] = basis;
    // Each turn shortens a vector by at least a thousandth or is the last, so this ends early.
    for _ in 0..10_000 {
        if dot(short, short) > dot(long, long) {
            std::mem::swap(&mut short, &mut long);
        }
        let times = (dot(short, long) / dot(short, short)).round();
        let next = [long[0] - times * short[0], long[1] - times * short[1]];
        if times == 0.0 || dot(next, next) >= 0.999 * dot(long, long) {
            break;
        }
        long = next;
    }
    [directed(short), directed(long)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Basis, b: Basis) -> bool {
        a.as_flattened().iter().zip(b.as_flattened()).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn a_basis_is_reduced_to_its_shortest_vectors() {
        let want = [[40.0, 1.0], [-20.0, 35.0]];
        for (a, b, c, d) in [(1, 0, 0, 1), (1, 1, 0, 1), (3, 2, 1, 1), (-5, 2, 2, -1), (7, 3, 2, 1)]
        {
            let make = |a: i32, b: i32| combined(want, f64::from(a), f64::from(b));
            let got = reduced([make(a, b), make(c, d)]);
            assert!((area(got) - area(want)).abs() < 1e-9, "{got:?}");
            assert!(close(got, [[40.0, 1.0], [20.0, -35.0]]), "{got:?}");
        }
    }

    #[test]
    fn directions_near_the_axes_do_not_turn_over() {
        for v in [[9.0, 0.1], [9.0, -0.1], [0.1, 9.0], [-0.1, 9.0], [6.0, -6.0], [6.0, 6.0]] {
            assert_eq!(directed(v), v);
            assert_eq!(directed([-v[0], -v[1]]), v);
        }
    }

    #[test]
    fn coefficients_undo_combined() {
        let basis = [[29.3, 1.3], [-0.9, 44.7]];
        let [a, b] = coefficients(basis, combined(basis, 3.0, -7.5));
        assert!((a - 3.0).abs() < 1e-12 && (b + 7.5).abs() < 1e-12);
        let [first, second] = dual(basis).expect("not parallel");
        let v = combined(basis, 3.0, -7.5);
        assert!((dot(first, v) - 3.0).abs() < 1e-12 && (dot(second, v) + 7.5).abs() < 1e-12);
        assert_eq!(dual([[4.0, 2.0], [2.0, 1.0]]), None);
    }
}
