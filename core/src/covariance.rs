//! The covariance of displacements besides the mark: a smooth deformation, shifts of patches and of
//! polygon groups, and noise.

use crate::{
    derived::{Observables, Site},
    patches::ALONE,
};
use faer::{
    Mat, Par, Side,
    linalg::{
        solvers::{Llt, Solve},
        triangular_solve::solve_lower_triangular_in_place,
    },
};

/// Standard deviation of the shift of a whole patch, metres; the shift is practically free.
pub(crate) const SHIFT_M: f64 = 1.0;

/// Hyper-parameters of the displacement, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deformation {
    /// σ_f, standard deviation of the deformation; 0 where there is none.
    pub deviation_m: f64,
    /// ℓ, the distance over which it changes.
    pub range_m: f64,
    /// Standard deviation of the shift of every polygon group as a whole; 0 where groups have none.
    pub group_shift_m: f64,
    /// σ, standard deviation of the noise.
    pub noise_m: f64,
}

impl Deformation {
    /// Returns a disturbance of noise alone.
    pub fn none(noise_m: f64) -> Self {
        Deformation { deviation_m: 0.0, range_m: 1.0, group_shift_m: 0.0, noise_m }
    }

    /// Returns σ_f² k(d / ℓ), Matérn 5/2.
    pub(crate) fn covariance(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        let d = (5.0 * ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2))).sqrt() / self.range_m;
        self.deviation_m.powi(2) * (1.0 + d + d * d / 3.0) * (-d).exp()
    }

    /// Returns whether nothing but a shift of the whole patch is disturbance.
    pub fn is_still(&self) -> bool {
        self.deviation_m == 0.0 && self.group_shift_m == 0.0
    }

    /// Returns the covariance of the shifts of two polygon groups.
    pub(crate) fn of_groups(&self, a: u32, b: u32) -> f64 {
        if a == b && a != ALONE { self.group_shift_m.powi(2) } else { 0.0 }
    }

    /// Returns the covariance of deformation, shifts and noise over found vertices, o × o. Only its
    /// lower triangle is filled, as the factorisation reads no more; weights divide the noise.
    pub(crate) fn matrix(&self, at: &[Site], weights: &[f64]) -> Mat<f64> {
        Mat::from_fn(at.len(), at.len(), |i, j| {
            if i < j {
                return 0.0;
            }
            let noise = if i == j { self.noise_m.powi(2) / weights[i] } else { 0.0 };
            let smooth = if self.deviation_m > 0.0 { self.covariance(at[i].at_m, at[j].at_m) } else { 0.0 };
            SHIFT_M.powi(2) + self.of_groups(at[i].group, at[j].group) + smooth + noise
        })
    }
}

/// The covariance Σ of deformation, shift and noise over o found vertices, factored.
pub(crate) enum Covariance {
    /// The Cholesky factor.
    Dense(Llt<f64>),
    /// Without a deformation Σ = P⁻¹ + s² 1 1ᵀ, where the diagonal P holds these precisions and
    /// needs no factorisation.
    Shift(Vec<f64>),
}

impl Covariance {
    pub fn new(deformation: &Deformation, at: &[Site], weights: &[f64]) -> Self {
        if !deformation.is_still() {
            return Covariance::Dense(factor(&deformation.matrix(at, weights)));
        }
        Covariance::Shift(weights.iter().map(|w| w / deformation.noise_m.powi(2)).collect())
    }

    /// Multiplies a square root of Σ⁻¹ by the columns of a matrix with o rows.
    pub fn whiten(&self, mut columns: Mat<f64>) -> Mat<f64> {
        match self {
            Covariance::Dense(factor) => {
                solve_lower_triangular_in_place(factor.L(), columns.as_mut(), Par::Seq);
            }
            Covariance::Shift(precisions) => {
                // With q = P^½ 1: Σ⁻¹ = P^½ (1 + s² q qᵀ)⁻¹ P^½, and (1 + s² q qᵀ)^−½ = 1 − β q qᵀ.
                let total: f64 = precisions.iter().sum();
                let beta = (1.0 - 1.0 / (1.0 + SHIFT_M.powi(2) * total).sqrt()) / total;
                let roots: Vec<f64> = precisions.iter().map(|p| p.sqrt()).collect();
                for j in 0..columns.ncols() {
                    let column = columns.col_as_slice_mut(j);
                    let mean: f64 = column.iter().zip(precisions).map(|(x, p)| x * p).sum::<f64>() * beta;
                    column.iter_mut().zip(&roots).for_each(|(x, q)| *x = q * (*x - mean));
                }
            }
        }
        columns
    }

    /// Multiplies Σ⁻¹ by the columns of a matrix with o rows.
    pub fn solve(&self, columns: &Mat<f64>) -> Mat<f64> {
        match self {
            Covariance::Dense(factor) => factor.solve(columns),
            Covariance::Shift(precisions) => {
                let total: f64 = precisions.iter().sum();
                let share = SHIFT_M.powi(2) / (1.0 + SHIFT_M.powi(2) * total);
                let mean =
                    |j| share * (0..columns.nrows()).map(|i| columns[(i, j)] * precisions[i]).sum::<f64>();
                let means: Vec<f64> = (0..columns.ncols()).map(mean).collect();
                Mat::from_fn(columns.nrows(), columns.ncols(), |i, j| {
                    precisions[i] * (columns[(i, j)] - means[j])
                })
            }
        }
    }
}

/// Returns the Cholesky factor of a covariance with noise.
pub(crate) fn factor(covariance: &Mat<f64>) -> Llt<f64> {
    Llt::new(covariance.as_ref(), Side::Lower).expect("a covariance with noise is positive definite")
}

/// The points of a patch that were found.
pub(crate) struct Found {
    /// Their positions among the points of the patch.
    pub rows: Vec<usize>,
    /// Their places.
    pub at: Vec<Site>,
    /// Their displacements, o × 2, metres.
    pub moved: Mat<f64>,
}

impl Found {
    pub fn new(of: Observables, patch: usize, observed: &[Option<[f64; 2]>]) -> Self {
        let points = of.in_patch(patch);
        let all = points.iter().enumerate();
        let (rows, displacement): (Vec<usize>, Vec<[f64; 2]>) = all
            .filter(|(row, _)| of.is_determined(patch, *row))
            .filter_map(|(row, &point)| Some((row, observed[point as usize]?)))
            .unzip();
        let at = rows.iter().map(|&row| of.place(points[row])).collect();
        Found { moved: Mat::from_fn(rows.len(), 2, |o, axis| displacement[o][axis]), rows, at }
    }
}
