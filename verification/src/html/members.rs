//! The parts of a mixture of copies: which patch comes from whose copy.

use super::{
    frame::{Frame, MOST_LABELLED},
    page::{count, figure},
};
use crate::{report::Evidence, words::clipped};
use maud::{Markup, html};

/// Number of colours; further members have the same ones again, and letters of their own.
const COLOURS: usize = 8;

/// Draws the patches in the colours of the recipients whose copies they come from; nothing unless
/// several are named.
pub fn members(evidence: &Evidence, frame: &Frame) -> Markup {
    let members = &evidence.members;
    if members.len() < 2 {
        return html! {};
    }
    let places = &evidence.sketch.patches;
    let owner = |patch: usize| evidence.patch_members.get(patch).copied().flatten();
    let drawing = html! {
        svg.map viewBox=(frame.view_box()) role="img" aria-label="Map of the patches, by whose copy they come from" {
            @for (number, place) in places.iter().enumerate() {
                path class=(owner(number).map_or("plain".into(), class)) d=(frame.path(std::iter::once(&place.outline), true)) {}
            }
            use href="#lines" {}
            @if places.len() <= MOST_LABELLED {
                @for (number, place) in places.iter().enumerate() {
                    @let [x, y] = frame.middle(&place.outline);
                    @if let Some(owner) = owner(number) { text x=(x) y=(y + 35) { (letter(owner)) } }
                }
            }
            (frame.foot(None))
        }
    };
    let of = |number: usize| evidence.patch_members.iter().filter(|owner| **owner == Some(number)).count();
    let caption = html! {
        b { "Whose copies were mixed. " }
        "A patch has the colour of the recipient whose secret signs it shows clearly more than those of all others. Where \
         copies were averaged, or mixed within a patch, it shows several recipients and has no colour."
        ul.legend {
            @for (number, member) in members.iter().enumerate() {
                li {
                    svg.swatch viewBox="0 0 120 80" aria-hidden="true" { rect class=(class(number)) width="120" height="80" {} }
                    span.name {
                        b { (letter(number)) } ", " (clipped(&member.recipient)) ": "
                        (count(of(number))) " of " (count(places.len())) " patches"
                    }
                }
            }
        }
    };
    figure(&drawing, &caption)
}

fn class(member: usize) -> String {
    format!("member m{}", member % COLOURS)
}

/// Returns A to Z, then A2, B2 and so on.
fn letter(member: usize) -> String {
    let letter = char::from(b'A' + (member % 26) as u8);
    match member / 26 {
        0 => letter.to_string(),
        again => format!("{letter}{}", again + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_member_has_letters_of_its_own() {
        assert_eq!([0, 25, 26, 53].map(letter), ["A", "Z", "A2", "B3"]);
    }
}
