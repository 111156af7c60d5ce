//! The search for the CRS of the suspect's coordinates: its own, unless they are implausible in it.
//!
//! Every likely CRS is a candidate start of the registration, with x and y exchanged or not. The
//! first one under which most vertices of the smaller map match ends the search; otherwise the one
//! with most matched vertices wins. No key is involved, so many attempts do not reduce the
//! significance.

use super::assumption::{Assumption, likely_assumptions, overlaps};
use crate::{Suspect, words::printable};
use meshmark_detection::registration::{ReadAs, Registrar, Registration, Start};
use meshmark_marking::{self as marking, Error, Numbers, Survey, TransformableCrs};

/// A suspect in the CRS of a reference.
#[derive(Clone)]
pub struct Placed<C> {
    /// The map in the CRS of the reference, where both CRS are known and the coordinates are valid
    /// in its own; otherwise the numbers of the suspect.
    pub map: Survey<C>,
    /// The numbers of the suspect.
    pub numbers: Numbers<C>,
    /// Whether `map` has these numbers.
    pub is_raw: bool,
    /// The first CRS of a layer.
    pub crs: Option<C>,
}

impl<C: TransformableCrs> Placed<C> {
    /// Brings a suspect into the CRS of the reference, where both are known. Where reprojection fails,
    /// the coordinates stay unchanged.
    ///
    /// # Errors
    /// Fails when the suspect has too many coordinates.
    pub fn new(suspect: Suspect<C>, reference: &Survey<C>) -> marking::Result<Self> {
        let Suspect { numbers, crs, .. } = suspect;
        if let (Some(target), Some(_)) = (&reference.crs, &crs) {
            match numbers.in_crs(target) {
                Ok(map) => return Ok(Placed { map, numbers, is_raw: false, crs }),
                // PROJ fails, or the map exceeds its limits, when the CRS is not that of the
                // coordinates.
                Err(Error::Reprojection { .. } | Error::FewPlaces { .. } | Error::Core(_)) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(Placed { map: numbers.clone().raw()?, numbers, is_raw: true, crs })
    }
}

/// A suspect and its registration.
pub struct Registered<C> {
    /// The map in the CRS of the reference.
    pub map: Survey<C>,
    /// The registration of that map.
    pub registration: Registration,
}

/// Registers a suspect under its own CRS, and under others when it has none or does not coincide
/// with the reference.
///
/// # Errors
/// Fails when the suspect has too many coordinates.
pub fn register<C: TransformableCrs>(
    registrar: &Registrar,
    reference: &Survey<C>,
    suspect: Placed<C>,
    start: Start,
) -> marking::Result<Registered<C>> {
    let Placed { map, numbers, is_raw, crs } = suspect;
    let doubtful = is_raw || !overlaps(&map, reference);
    let at_first = match start {
        Start::None => registrar.as_it_stands(&map.data),
        // A wrong CRS distorts a map in a way that is not quite affine, so the right one is tried
        // before other starts.
        Start::Auto if doubtful => registrar.refine_in_place(&map.data),
        _ => registrar.register(&map.data, start),
    };
    // Coordinates that were not reprojected are assumed to be in the CRS of the reference.
    let has_numbers = is_raw && !map.data.vertices.is_empty();
    let own =
        reference.crs.clone().filter(|_| has_numbers).map(|crs| Assumption { crs, axes_swapped: false });
    let plain = Registered::new(map, own.as_ref(), at_first);
    if start == Start::None || plain.agrees() || !doubtful && plain.registration.agrees_in_part() {
        return Ok(plain);
    }
    let assumptions = match is_raw {
        true => likely_assumptions(&plain.map, crs.as_ref(), reference),
        false => likely_assumptions(&numbers.clone().raw()?, crs.as_ref(), reference),
    };
    let assumed = in_place(registrar, reference, &numbers, &assumptions);
    if start == Start::Auto && assumed.as_ref().is_some_and(Registered::agrees) {
        return Ok(assumed.expect("it agrees"));
    }
    let plain = match doubtful && start == Start::Auto {
        true => plain.search_all(registrar, start),
        false => plain, // this start was searched before
    };
    let Some(assumed) = assumed.filter(|_| !plain.registration.agrees_in_part()) else { return Ok(plain) };
    Ok(plain.or_better(assumed.search_all(registrar, start)))
}

/// Returns the assumption with most matched vertices in place.
fn in_place<C: TransformableCrs>(
    registrar: &Registrar,
    reference: &Survey<C>,
    numbers: &Numbers<C>,
    assumptions: &[Assumption<C>],
) -> Option<Registered<C>> {
    let target = reference.crs.as_ref()?;
    let mut best: Option<Registered<C>> = None;
    for assumption in assumptions {
        let Ok(map) = numbers.assumed((&assumption.crs, assumption.axes_swapped), target) else { continue };
        let registration = registrar.refine_in_place(&map.data);
        let next = Registered::new(map, Some(assumption), registration);
        let agrees = next.agrees();
        best = Some(match best {
            Some(best) => best.or_better(next),
            None => next,
        });
        if agrees {
            break;
        }
    }
    best
}

impl<C: TransformableCrs> Registered<C> {
    fn new(map: Survey<C>, assumption: Option<&Assumption<C>>, registration: Registration) -> Self {
        let read_as = assumption.map(|assumed| ReadAs {
            crs: printable(&assumed.crs.brief_name()),
            axes_swapped: assumed.axes_swapped,
        });
        Registered { map, registration: Registration { read_as, ..registration } }
    }

    fn agrees(&self) -> bool {
        self.registration.agrees()
    }

    /// Registers the same map from all starts.
    fn search_all(self, registrar: &Registrar, start: Start) -> Self {
        let read_as = self.registration.read_as;
        let registration = registrar.register(&self.map.data, start);
        Registered { map: self.map, registration: Registration { read_as, ..registration } }
    }

    fn or_better(self, next: Self) -> Self {
        if next.registration.matched > self.registration.matched { next } else { self }
    }
}
