use crate::code::Code;

/// What can go wrong in the algorithm. Every message says what would have been legal.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // the messages are the documentation
pub enum Error {
    #[error("vertex {index} has the coordinates ({x}, {y}): every coordinate must be a finite number")]
    NotFinite { index: usize, x: f64, y: f64 },
    #[error("the coordinates span {span:e} units: more than the 1e30 a mesh can be built on")]
    TooWide { span: f64 },
    #[error("the map has no vertices: give one with geometry")]
    NoVertices,
    #[error(
        "the map has {vertices} distinct vertices, fewer than PATCH_SIZE={patch_size}: {}",
        patch_size_hint(*.vertices)
    )]
    TooFewVertices { vertices: usize, patch_size: usize },
    #[error(
        "all {vertices} distinct vertices lie on one straight line, so they have no mesh: \
         mark a map whose vertices spread over an area"
    )]
    Collinear { vertices: usize },
    #[error(
        "a message of {bits} bits with {}CHIP_RATE={chip_rate} needs {} coefficients, but the smallest patch \
         ({vertices} vertices) has {}: use {}",
        if *.code == Code::Ldpc { "CODE=LDPC and " } else { "" },
        .code.expansion() * .bits * .chip_rate, .vertices - 1, what_fits(*.code, *.bits, *.vertices)
    )]
    TooManyCoefficients { code: Code, bits: usize, chip_rate: usize, vertices: usize },
    #[error(
        "CODE=LDPC carries a message of exactly 128 bits, not {bits}: use 32 hexadecimal digits, a RECIPIENT, \
         or CODE=REPETITION"
    )]
    CodeLength { bits: usize },
    #[error(
        "PRECISION={precision} is {metres} m on the ground here, more than TOLERANCE={tolerance_m} m: \
         use a finer PRECISION or a larger TOLERANCE"
    )]
    PrecisionTooCoarse { precision: f64, metres: f64, tolerance_m: f64 },
    #[error(
        "after marking, {errors} of the {bits} message bits cannot be read back: \
         raise AMPLITUDE or CHIP_RATE, lower PATCH_SIZE, or use a finer PRECISION or a larger TOLERANCE"
    )]
    MessageLost { errors: usize, bits: usize },
    #[error("the eigenvalues of a patch of {vertices} vertices did not converge: change PATCH_SIZE slightly")]
    NoConvergence { vertices: usize },
    #[error("message \"{0}\" is not 2 to 256 hexadecimal digits (0-9, a-f)")]
    Message(String),
    #[error("malformed key: {0}; a key file is what `meshmark keygen` writes")]
    Key(String),
    #[error("malformed record: {0}; a record is what the driver writes to RECORD=")]
    Record(String),
    #[error("{0}")]
    Option(String),
}

/// The result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

fn what_fits(code: Code, bits: usize, vertices: usize) -> String {
    let most = (vertices - 1) / (code.expansion() * bits);
    let chip_rate = if most > 0 { format!("CHIP_RATE={most} or less, ") } else { String::new() };
    let message = if code == Code::Ldpc { "CODE=REPETITION" } else { "a shorter message" };
    format!("{chip_rate}{message} or a larger PATCH_SIZE")
}

fn patch_size_hint(vertices: usize) -> String {
    let smallest = crate::options::PATCH_SIZE_RANGE.0;
    if vertices < smallest {
        return format!("a map needs at least {smallest} vertices to carry a mark");
    }
    format!("PATCH_SIZE={vertices} or less fits (the message must fit too: bits x CHIP_RATE < PATCH_SIZE)")
}
