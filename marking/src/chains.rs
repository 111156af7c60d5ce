//! Chains of coordinates in reading order: rings, lines and points, one after the other.

use crate::{
    Error, Extent, Result,
    left_out::{Faults, is_there},
    wkb::{self, Step, WkbError},
};
use meshmark_core::map_data::ChainKind;
use std::collections::BTreeMap;

/// Coordinates of rings, lines and points, one after the other.
#[derive(Debug, Clone, Default)]
pub struct Chains {
    /// CRS units.
    pub coords: Vec<[f64; 2]>,
    /// The index in `coords` where each chain starts, ascending.
    pub starts: Vec<u32>,
    /// The kind of each chain.
    pub kinds: Vec<Step>,
    /// The number of the first chain of each geometry, ascending.
    pub firsts: Vec<u32>,
    /// The geometries that their chains do not describe completely, by number.
    pub others: BTreeMap<u32, Vec<u8>>,
}

impl Chains {
    /// Returns the role of each chain in polygons.
    pub fn chain_kinds(&self) -> impl Iterator<Item = ChainKind> {
        self.kinds.iter().map(|step| match step {
            Step::Shell => ChainKind::Shell,
            Step::Hole => ChainKind::Hole,
            Step::First | Step::Next => ChainKind::Line,
        })
    }

    /// Appends the coordinates of one geometry, well-known binary, of the feature `fid` of a layer.
    /// Those that are left out are [missing](crate::left_out::MISSING). Geometries that their chains
    /// do not describe are kept if `keeps_geometries`.
    ///
    /// # Errors
    /// Fails on a malformed geometry and on coordinates outside the extent, unless faults are left
    /// out.
    pub fn read(
        &mut self,
        mut bytes: Vec<u8>,
        (layer, fid): (&str, &dyn Fn() -> String),
        (keeps_geometries, extent): (bool, Extent),
        mut faults: Faults,
    ) -> Result<()> {
        if keeps_geometries && !wkb::is_plain(&bytes) {
            self.others.insert(self.firsts.len() as u32, bytes.clone());
        }
        self.begin_geometry();
        let mut visit = |step, point: [f64; 2]| {
            let kept =
                extent.check(point, layer, fid).map_or_else(|fault| faults.coordinate(fault), |()| Ok(point));
            self.push(step, kept?);
            Ok(point)
        };
        match wkb::map_coordinates::<Visit>(&mut bytes, &mut |step, point| {
            visit(step, point).map_err(Visit::Ours)
        }) {
            Ok(()) => Ok(()),
            Err(Visit::Ours(error)) => Err(error),
            Err(Visit::Wkb(error)) => faults.feature(Error::geometry(layer, fid(), error)),
        }
    }

    fn begin_geometry(&mut self) {
        self.firsts.push(self.starts.len() as u32);
    }

    fn push(&mut self, step: Step, point: [f64; 2]) {
        if step != Step::Next {
            self.starts.push(self.coords.len() as u32);
            self.kinds.push(step);
        }
        self.coords.push(point);
    }

    /// Removes the missing coordinates. What is left of a ring or line is a line on either side of
    /// each, and the holes of a ring that is not whole are lines.
    pub fn close_up(&mut self) {
        if self.coords.iter().all(is_there) {
            return;
        }
        let Chains { coords, starts, kinds, firsts, others } = std::mem::take(self);
        self.others = others;
        let ends = starts.iter().skip(1).map(|&start| start as usize).chain([coords.len()]);
        let mut firsts = firsts.into_iter().peekable();
        let mut has_shell = false;
        for (chain, (end, (&start, &kind))) in ends.zip(starts.iter().zip(&kinds)).enumerate() {
            while firsts.next_if(|&first| first as usize <= chain).is_some() {
                self.begin_geometry();
            }
            let points = &coords[start as usize..end];
            let is_whole = points.iter().all(is_there);
            if kind != Step::Hole {
                has_shell = is_whole && kind == Step::Shell;
            }
            let mut step = if is_whole && has_shell { kind } else { Step::First };
            for point in points {
                if is_there(point) {
                    self.push(step, *point);
                }
                step = if is_there(point) { Step::Next } else { Step::First };
            }
        }
        firsts.for_each(|_| self.begin_geometry());
    }

    /// Appends the chains of another walk, which is then empty.
    pub fn append(&mut self, other: &mut Chains) {
        if self.firsts.is_empty() {
            return std::mem::swap(self, other);
        }
        let (of_starts, offset) = (self.starts.len() as u32, self.coords.len() as u32);
        let geometries = self.firsts.len() as u32;
        let others = std::mem::take(&mut other.others);
        self.others.extend(others.into_iter().map(|(number, wkb)| (number + geometries, wkb)));
        self.firsts.extend(other.firsts.drain(..).map(|first| first + of_starts));
        self.starts.extend(other.starts.drain(..).map(|start| start + offset));
        self.coords.append(&mut other.coords);
        self.kinds.append(&mut other.kinds);
    }
}

enum Visit {
    Ours(Error),
    Wkb(WkbError),
}

impl From<WkbError> for Visit {
    fn from(error: WkbError) -> Self {
        Visit::Wkb(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::left_out::MISSING;

    #[test]
    fn a_missing_coordinate_parts_its_line_and_makes_lines_of_its_ring_and_the_holes() {
        use Step::{First, Hole, Next, Shell};
        let mut chains = Chains::default();
        let at = |x: f64| [x, 0.0];
        for geometry in [
            &[(First, at(0.0)), (Next, MISSING), (Next, at(1.0)), (Next, at(2.0))][..],
            &[(Shell, at(3.0)), (Next, at(4.0)), (Next, MISSING), (Hole, at(5.0)), (Next, at(6.0))],
            &[(Shell, at(7.0)), (Next, at(8.0)), (Hole, MISSING), (Next, at(9.0)), (Hole, at(10.0))],
            &[(First, MISSING)],
            &[(Shell, at(11.0)), (Next, at(12.0))],
        ] {
            chains.begin_geometry();
            geometry.iter().for_each(|(step, point)| chains.push(*step, *point));
        }
        chains.close_up();
        assert_eq!(chains.coords, (0..13).map(|x| at(x.into())).collect::<Vec<_>>());
        assert_eq!(chains.starts, [0, 1, 3, 5, 7, 9, 10, 11]);
        assert_eq!(chains.kinds, [First, First, First, First, Shell, First, Hole, Shell]);
        assert_eq!(chains.firsts, [0, 2, 4, 7, 7]);
    }
}
