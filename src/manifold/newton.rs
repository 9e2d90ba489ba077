//! The Newton step: a small dense system by elimination with partial pivoting.
//!
//! The matrix is block-tridiagonal, but elimination block by block fails where a leading block is
//! singular and the system is not: at an inner focal point. Rows are therefore exchanged across blocks.

use super::MAX_CHAIN;
use super::constraint::Block;

/// Unknowns of the longest chain.
const MAX_SIZE: usize = 2 * MAX_CHAIN;

/// Pivots at or below this share of the largest entry make the system singular.
const SINGULAR: f64 = 1e-12;

/// `M x = c` of up to [`MAX_CHAIN`] vertices.
pub(super) struct System {
    size: usize,
    matrix: [[f64; MAX_SIZE]; MAX_SIZE],
    right: [f64; MAX_SIZE],
}

impl System {
    /// A system of zeros for `vertices` vertices.
    #[inline]
    pub(super) fn new(vertices: usize) -> System {
        System { size: 2 * vertices, matrix: [[0.0; MAX_SIZE]; MAX_SIZE], right: [0.0; MAX_SIZE] }
    }

    /// Sets the equations of vertex `row` as functions of vertex `column`.
    #[inline]
    pub(super) fn set_block(&mut self, row: usize, column: usize, block: Block) {
        for (r, values) in block.into_iter().enumerate() {
            self.matrix[2 * row + r][2 * column..2 * column + 2].copy_from_slice(&values);
        }
    }

    /// Sets the right-hand side of vertex `row`.
    #[inline]
    pub(super) fn set_right(&mut self, row: usize, values: [f64; 2]) {
        self.right[2 * row..2 * row + 2].copy_from_slice(&values);
    }

    /// Triangular form, in place: the determinant, or `None` if the matrix is singular or not finite.
    #[inline]
    pub(super) fn eliminate(&mut self) -> Option<f64> {
        let size = self.size;
        let rows = &self.matrix[..size];
        let largest = rows.iter().flat_map(|r| &r[..size]).fold(0.0f64, |m, x| m.max(x.abs()));
        let mut determinant = 1.0;
        for k in 0..size {
            let mut pivot = k;
            for row in k + 1..size {
                if self.matrix[row][k].abs() > self.matrix[pivot][k].abs() {
                    pivot = row;
                }
            }
            if pivot != k {
                self.matrix.swap(k, pivot);
                self.right.swap(k, pivot);
                determinant = -determinant;
            }
            let diagonal = self.matrix[k][k];
            // Written so that NaN fails, too.
            if !(diagonal.abs() > SINGULAR * largest) {
                return None;
            }
            determinant *= diagonal;
            let (upper, lower) = self.matrix[..size].split_at_mut(k + 1);
            let source = &upper[k];
            for (offset, row) in lower.iter_mut().enumerate() {
                let factor = row[k] / diagonal;
                if factor != 0.0 {
                    for j in k + 1..size {
                        row[j] -= factor * source[j];
                    }
                    self.right[k + 1 + offset] -= factor * self.right[k];
                }
            }
        }
        Some(determinant)
    }

    /// The solution, in place; `None` if the matrix is singular.
    #[inline]
    pub(super) fn solve(&mut self) -> Option<&[f64]> {
        self.eliminate()?;
        for k in (0..self.size).rev() {
            let known: f64 = (k + 1..self.size).map(|j| self.matrix[k][j] * self.right[j]).sum();
            self.right[k] = (self.right[k] - known) / self.matrix[k][k];
        }
        Some(&self.right[..self.size])
    }
}

/// `M x = c` of two equations; `None` if the matrix is singular.
#[inline]
pub(super) fn solve_block(m: Block, c: [f64; 2]) -> Option<[f64; 2]> {
    let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    let largest = m.as_flattened().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    // Written so that NaN fails, too.
    if !(determinant.abs() > SINGULAR * largest * largest) {
        return None;
    }
    let x = c[0] * m[1][1] - m[0][1] * c[1];
    let y = m[0][0] * c[1] - c[0] * m[1][0];
    Some([x / determinant, y / determinant])
}
