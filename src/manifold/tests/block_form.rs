//! The geometry term by the block system (Jakob and Marschner 2012): an oracle that shares nothing with
//! the ray differentials but the surfaces.

use super::*;
use crate::geometry::differential::tangents;
use crate::manifold::constraint::{Block, Constraint, Form, Joint};
use crate::manifold::newton::System;

fn determinant(b: Block) -> f64 {
    (b[0][0] * b[1][1] - b[0][1] * b[1][0]).abs()
}

/// `J` for an end that faces the arriving ray, or `J_dir`: `cos_1/|x_1 - a|^2 prod |det C| / |det M|`.
pub(super) fn jacobian(chain: &Chain, form: impl Fn(f64, f64) -> Form) -> f64 {
    let (vertices, lengths, crossings) = (chain.vertices(), chain.lengths(), chain.crossings());
    let n = vertices.len();
    let mut directions = vec![chain.first];
    directions.extend((1..n).map(|i| (vertices[i].p - vertices[i - 1].p).normalize()));
    directions.push(-chain.last);
    let mut system = System::new(n);
    let mut product = chain.first.dot(vertices[0].ng).abs() / lengths[0].powi(2);
    for i in 0..n {
        let Crossing { n_i, n_o, .. } = crossings[i];
        let joint = Joint {
            at: &vertices[i],
            w_i: -directions[i],
            inverse_r_i: 1.0 / lengths[i],
            w_o: directions[i + 1],
            inverse_r_o: 1.0 / lengths[i + 1],
            n_i,
            n_o,
        };
        let constraint = Constraint::new(joint, form(n_i, n_o));
        system.set_block(i, i, constraint.own());
        if i > 0 {
            system.set_block(i, i - 1, constraint.previous([vertices[i - 1].p_u, vertices[i - 1].p_v]));
        }
        let next = if i + 1 < n {
            let block = constraint.next([vertices[i + 1].p_u, vertices[i + 1].p_v]);
            system.set_block(i, i + 1, block);
            block
        } else {
            let (u, v) = tangents(directions[n]);
            if lengths[n].is_finite() { constraint.next([u, v]) } else { constraint.direction([u, v]) }
        };
        product *= determinant(next);
    }
    product / system.eliminate().expect("a regular system").abs()
}
