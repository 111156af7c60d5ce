//! The response of the vertices of a patch to its coefficients, constraints included.

use crate::{
    options::{AmplitudeOf, Parameters, Rigidity},
    patches::{BodyRows, Patch},
    spectrum::Basis,
    stiffness::stiffen,
};
use faer::{
    Accum, Mat, Par, Scale,
    linalg::matmul::{
        matmul,
        triangular::{self, BlockStructure},
    },
};

/// The shares of vertices in the displacement of a point: a vertex, and for the axes a and b of the
/// point and of the vertex the derivative `[a][b]`.
pub type Shares = [(u32, [[f64; 2]; 2])];

/// The displacements by unit coefficients, n × k per axis.
pub(crate) enum Response {
    /// Both axes respond alike, each to its own coefficients.
    Separate(Mat<f64>),
    /// A body that turns couples them: `[a][b]` is how axis a responds to coefficients of axis b.
    Coupled([[Mat<f64>; 2]; 2]),
}

/// The products of all columns with all columns.
pub(crate) struct Kernel {
    /// Products of columns of one axis, for the named axes: lower triangles, k × k.
    pub own: Vec<(Vec<usize>, Mat<f64>)>,
    /// Products of columns of the first axis (rows) with those of the second (columns), where they
    /// are not 0.
    pub cross: Option<Mat<f64>>,
}

impl Kernel {
    /// Returns the sum of the diagonal.
    pub fn trace(&self) -> f64 {
        let of = |(axes, lower): &(Vec<usize>, Mat<f64>)| {
            axes.len() as f64 * (0..lower.ncols()).map(|i| lower[(i, i)]).sum::<f64>()
        };
        self.own.iter().map(of).sum()
    }
}

impl Response {
    /// Returns the response to the coefficients that carry the mark, all but the mean. It is
    /// amplified, so that the expected displacement, root mean square, is that of free vertices
    /// whatever the shape, or the amplitude itself where this is what it measures.
    pub fn carriers(patch: &Patch, basis: &Basis, parameters: &Parameters) -> Self {
        let carriers = basis.vectors.subcols(1, basis.vectors.ncols() - 1);
        let mut response = Self::new(patch, carriers.to_owned());
        let gain = match (parameters.amplitude_of, parameters.shape) {
            (AmplitudeOf::Displacement, _) => root(patch.vertices.len() as f64 / response.energy()),
            (AmplitudeOf::Coefficient, Rigidity::Free) => return response,
            (AmplitudeOf::Coefficient, _) => response.gain(patch, carriers.to_owned()),
        };
        response.blocks_mut().iter_mut().for_each(|block| *block *= Scale(gain));
        response
    }

    /// Returns the ratio of the root mean square displacements by the basis functions with
    /// T-junctions alone and with bodies and stiffness.
    pub fn gain(&self, patch: &Patch, mut basis: Mat<f64>) -> f64 {
        let Response::Coupled(_) = self else { return 1.0 };
        patch.follow(&mut basis);
        root(2.0 * basis.squared_norm_l2() / self.energy())
    }

    /// Returns the expected Σ |Δ|² over all vertices, for random coefficients of ±1.
    fn energy(&self) -> f64 {
        match self {
            Response::Separate(block) => 2.0 * block.squared_norm_l2(),
            Response::Coupled(blocks) => {
                blocks.as_flattened().iter().map(|block| block.squared_norm_l2()).sum()
            }
        }
    }

    /// Returns the response to basis functions (columns, n × k): free vertices follow them, stiff
    /// ones with little change of angles and lengths; bodies follow by the nearest rigid motion, and
    /// hanging vertices follow their anchors.
    pub fn new(patch: &Patch, basis: Mat<f64>) -> Self {
        let mut response = match patch.bodies.is_empty() && patch.strains.is_empty() {
            true => Response::Separate(basis),
            false => {
                let mut blocks = coupled(patch, basis);
                stiffen(&patch.strains, &patch.free_rows(), &mut blocks);
                Response::Coupled(blocks)
            }
        };
        response.blocks_mut().iter_mut().for_each(|block| patch.follow(block));
        response
    }

    fn blocks_mut(&mut self) -> &mut [Mat<f64>] {
        match self {
            Response::Separate(block) => std::slice::from_mut(block),
            Response::Coupled(blocks) => blocks.as_flattened_mut(),
        }
    }

    /// Returns the covariance over vertices of the displacement along one axis for random
    /// coefficients of ±1, or the mean of both axes where they differ.
    pub fn covariance(&self) -> Mat<f64> {
        let of = |block: &Mat<f64>| block * block.transpose();
        match self {
            Response::Separate(block) => of(block),
            Response::Coupled([[xx, xy], [yx, yy]]) => (of(xx) + of(xy) + of(yx) + of(yy)) * Scale(0.5),
        }
    }

    /// Transforms every block by `f`.
    pub fn map(self, f: impl Fn(Mat<f64>) -> Mat<f64>) -> Self {
        match self {
            Response::Separate(block) => Response::Separate(f(block)),
            Response::Coupled(blocks) => Response::Coupled(blocks.map(|row| row.map(&f))),
        }
    }

    /// Returns the products of all columns with all columns.
    pub fn kernel(&self) -> Kernel {
        match self {
            Response::Separate(block) => {
                Kernel { own: vec![(vec![0, 1], lower_gram(&[block]))], cross: None }
            }
            Response::Coupled([[xx, xy], [yx, yy]]) => Kernel {
                own: vec![(vec![0], lower_gram(&[xx, yx])), (vec![1], lower_gram(&[xy, yy]))],
                cross: Some(products(&[(xx, xy), (yx, yy)])),
            },
        }
    }

    /// Returns the displacement of every row by coefficients of either axis, metres.
    pub fn synthesise(&self, coefficients: &[Vec<f64>; 2]) -> Vec<[f64; 2]> {
        let [cx, cy] = coefficients.each_ref().map(|values| faer::ColRef::from_slice(values));
        let [x, y] = match self {
            Response::Separate(block) => [block * cx, block * cy],
            Response::Coupled([[xx, xy], [yx, yy]]) => [xx * cx + xy * cy, yx * cx + yy * cy],
        };
        x.iter().zip(y.iter()).map(|(x, y)| [*x, *y]).collect()
    }

    /// Returns the products of the columns of either axis with displacements (n × 2).
    pub fn correlations(&self, moved: &Mat<f64>) -> [Vec<f64>; 2] {
        let (x, y) = (moved.col(0), moved.col(1));
        let products = match self {
            Response::Separate(block) => [block.transpose() * x, block.transpose() * y],
            Response::Coupled([[xx, xy], [yx, yy]]) => {
                [xx.transpose() * x + yx.transpose() * y, xy.transpose() * x + yy.transpose() * y]
            }
        };
        products.map(|product| product.iter().copied().collect())
    }

    /// Returns the rows of some vertices, ascending.
    pub fn rows(&self, rows: &[usize]) -> Self {
        let of = |block: &Mat<f64>| {
            if rows.len() == block.nrows() {
                return block.clone();
            }
            let mut kept = Mat::zeros(rows.len(), block.ncols());
            for column in 0..block.ncols() {
                let all = block.col_as_slice(column);
                kept.col_as_slice_mut(column).iter_mut().zip(rows).for_each(|(to, &row)| *to = all[row]);
            }
            kept
        };
        match self {
            Response::Separate(block) => Response::Separate(of(block)),
            Response::Coupled(blocks) => {
                Response::Coupled(blocks.each_ref().map(|row| row.each_ref().map(of)))
            }
        }
    }

    /// Returns the rows of points that are derived from vertices.
    pub fn derived(&self, points: &[&Shares]) -> Self {
        let zeros = || [0, 1].map(|_| [0, 1].map(|_| Mat::zeros(points.len(), self.columns())));
        let mut blocks: [[Mat<f64>; 2]; 2] = zeros();
        for (point, (row, shares)) in
            points.iter().enumerate().flat_map(|(point, shares)| shares.iter().map(move |s| (point, *s)))
        {
            for (axis, of_axes) in shares.iter().enumerate() {
                for (of_axis, share) in of_axes.iter().enumerate().filter(|(_, share)| **share != 0.0) {
                    for (coefficients, block) in self.row_of(of_axis) {
                        let derived = &mut blocks[axis][coefficients];
                        (0..block.ncols())
                            .for_each(|i| derived[(point, i)] += share * block[(row as usize, i)]);
                    }
                }
            }
        }
        Response::Coupled(blocks)
    }

    /// Returns the displacements of all rows along x, then along y, by every unit coefficient of
    /// axis x, then of axis y.
    pub fn columns_of_coordinates(&self) -> Vec<Vec<f64>> {
        let of = |coefficients: usize, i: usize| {
            let of_axis = |axis: usize| -> Vec<f64> {
                match self {
                    Response::Separate(block) if axis == coefficients => {
                        block.col(i).iter().copied().collect()
                    }
                    Response::Separate(block) => vec![0.0; block.nrows()],
                    Response::Coupled(blocks) => blocks[axis][coefficients].col(i).iter().copied().collect(),
                }
            };
            [of_axis(0), of_axis(1)].concat()
        };
        let columns = self.columns();
        (0..2).flat_map(|axis| (0..columns).map(move |i| (axis, i))).map(|(axis, i)| of(axis, i)).collect()
    }

    fn columns(&self) -> usize {
        match self {
            Response::Separate(block) => block.ncols(),
            Response::Coupled([[block, _], _]) => block.ncols(),
        }
    }

    /// Returns the blocks by which an axis responds, each with the axis of its coefficients.
    fn row_of(&self, axis: usize) -> Vec<(usize, &Mat<f64>)> {
        match self {
            Response::Separate(block) => vec![(axis, block)],
            Response::Coupled(blocks) => blocks[axis].iter().enumerate().collect(),
        }
    }
}

/// Returns the square root of a ratio of energies; 1 where nothing moves.
fn root(ratio: f64) -> f64 {
    if ratio.is_finite() { ratio.sqrt() } else { 1.0 }
}

/// Returns the lower triangle of Σ XᵀX, zeros above it.
fn lower_gram(blocks: &[&Mat<f64>]) -> Mat<f64> {
    let mut gram = Mat::zeros(blocks[0].ncols(), blocks[0].ncols());
    for x in blocks {
        triangular::matmul(
            gram.as_mut(),
            BlockStructure::TriangularLower,
            Accum::Add,
            x.transpose(),
            BlockStructure::Rectangular,
            x,
            BlockStructure::Rectangular,
            1.0,
            Par::Seq,
        );
    }
    gram
}

/// Returns Σ XᵀY.
fn products(pairs: &[(&Mat<f64>, &Mat<f64>)]) -> Mat<f64> {
    let mut sum = Mat::zeros(pairs[0].0.ncols(), pairs[0].1.ncols());
    for (x, y) in pairs {
        matmul(sum.as_mut(), Accum::Add, x.transpose(), y, 1.0, Par::Seq);
    }
    sum
}

/// Returns the coupled response: bodies shift by the mean of their vertices and turn by
/// θ = Σ (r_x u_y − r_y u_x) / Σ |r|²: the rigid motion nearest to the displacements u.
fn coupled(patch: &Patch, basis: Mat<f64>) -> [[Mat<f64>; 2]; 2] {
    let (n, columns) = (basis.nrows(), basis.ncols());
    let mut blocks = [[basis.clone(), Mat::zeros(n, columns)], [Mat::zeros(n, columns), basis]];
    let inertia = |body: &BodyRows| body.arms_m.iter().map(|[x, y]| x * x + y * y).sum::<f64>();
    let bodies: Vec<(&BodyRows, f64)> = patch.bodies.iter().map(|body| (body, inertia(body))).collect();
    for column in 0..columns {
        let [[xx, xy], [yx, yy]] =
            blocks.each_mut().map(|row| row.each_mut().map(|block| block.col_as_slice_mut(column)));
        for (body, inertia) in &bodies {
            let own = || body.rows.iter().map(|&row| xx[row as usize]);
            let moment = |axis: usize| {
                let sum: f64 = body.arms_m.iter().zip(own()).map(|(arm, value)| arm[axis] * value).sum();
                if *inertia > 0.0 { sum / inertia } else { 0.0 }
            };
            let (shift, moments) = (own().sum::<f64>() / body.rows.len() as f64, [moment(0), moment(1)]);
            for (&row, [x, y]) in body.rows.iter().zip(&body.arms_m) {
                let row = row as usize;
                xx[row] = shift + y * moments[1];
                xy[row] = -y * moments[0];
                yx[row] = -x * moments[1];
                yy[row] = shift + x * moments[0];
            }
        }
    }
    blocks
}
