//! Eigenvectors of small symmetric matrices.

/// Eigenvalues, largest first, and their unit eigenvectors of a symmetric matrix, by Jacobi's rotations.
///
/// Of each vector's two signs the one with which its largest component is positive (the first of several
/// equal ones), so that the result depends on nothing but the matrix.
pub fn eigen(matrix: &[Vec<f64>]) -> Vec<(f64, Vec<f64>)> {
    let n = matrix.len();
    let mut a = matrix.to_vec();
    let mut vectors: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for _ in 0..SWEEPS {
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                let (above, below) = a.split_at_mut(q);
                for (x, y) in above[p].iter_mut().zip(&mut below[0]) {
                    (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
                }
                for row in &mut vectors {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
            }
        }
    }
    let vector = |k: usize| {
        let v: Vec<f64> = vectors.iter().map(|row| row[k]).collect();
        let largest = v.iter().fold(0.0f64, |m, x| if x.abs() > m.abs() + 1e-9 { *x } else { m });
        if largest < 0.0 { v.iter().map(|x| -x).collect() } else { v }
    };
    let mut all: Vec<_> = (0..n).map(|k| (a[k][k], vector(k))).collect();
    all.sort_by(|x, y| y.0.total_cmp(&x.0));
    all
}

/// Convergence is quadratic: a handful does for a few dozen rows.
const SWEEPS: usize = 12;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_takes_the_matrix_apart(n in 1usize..9, numbers in prop::collection::vec(-3.0..3.0f64, 81)) {
            let matrix: Vec<Vec<f64>> =
                (0..n).map(|i| (0..n).map(|j| numbers[i * 9 + j] + numbers[j * 9 + i]).collect()).collect();
            let parts = eigen(&matrix);
            for i in 0..n {
                for j in 0..n {
                    let again: f64 = parts.iter().map(|(l, v)| l * v[i] * v[j]).sum();
                    prop_assert!((again - matrix[i][j]).abs() < 1e-9);
                    let product: f64 = (0..n).map(|k| parts[i].1[k] * parts[j].1[k]).sum();
                    prop_assert!((product - f64::from(u8::from(i == j))).abs() < 1e-9);
                }
            }
            prop_assert!(parts.windows(2).all(|w| w[0].0 >= w[1].0));
        }
    }
}
