//! The test vectors of fixtures/vectors, which `make_vectors` writes and tests/vectors.rs compares.

use crate::plugin::fixture;
use gdal::{Dataset, vector::LayerAccess};
use meshmark_core::{
    carrier::{Carrier, bit_of_coefficient},
    code::Code,
    demodulation,
    embedding::{Marked, embed},
    ground::Ground,
    key::SecretKey,
    mesh::Mesh,
    message::Message,
    options::Parameters,
    patches::{Patch, Patches},
    spectrum::Basis,
    vertices::VertexTable,
};
use meshmark_dataset::{Selection, Survey, survey};
use meshmark_marking::wkb;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The recipient of the marked map.
pub const RECIPIENT: &str = "ACME GmbH";
/// Number of values that are written of a long sequence.
const FIRST: usize = 8;

/// Returns the folder of the test vectors.
pub fn folder() -> PathBuf {
    fixture("vectors")
}

/// Returns the path of the reference map.
pub fn reference_path() -> PathBuf {
    fixture("kotka.gpkg")
}

/// Returns the marked map.
pub fn marked_path() -> PathBuf {
    folder().join("marked.gpkg")
}

/// Returns the key, the bytes 0 to 31; it protects nothing.
pub fn key() -> SecretKey {
    SecretKey::from_bytes(std::array::from_fn(|i| i as u8))
}

/// Reads a map as the driver does.
///
/// # Panics
/// Panics when it cannot be read.
pub(crate) fn read(path: &Path, selection: &Selection) -> Survey {
    let dataset = Dataset::open(path).expect("a map GDAL opens");
    survey(&dataset, selection).expect("a map of one CRS")
}

/// Returns every coordinate of a map, feature by feature.
///
/// # Panics
/// Panics when it cannot be read.
pub fn coordinates(path: &Path) -> Vec<[f64; 2]> {
    let dataset = Dataset::open(path).expect("a map GDAL opens");
    let mut all = Vec::new();
    for mut layer in dataset.layers() {
        for feature in layer.features() {
            let mut bytes = feature.geometry().expect("a geometry").iso_wkb().expect("WKB");
            let mut push = |_, point| {
                all.push(point);
                Ok::<_, wkb::WkbError>(point)
            };
            wkb::map_coordinates(&mut bytes, &mut push).expect("a geometry");
        }
    }
    all
}

/// The marking of the reference, with all values that determine it.
pub struct ReferenceMarking {
    /// The vertices of the reference map.
    pub reference: VertexTable,
    /// Metres on the ground.
    pub ground: Ground,
    /// The default parameters with the paper's code.
    pub parameters: Parameters,
    /// The message of the recipient.
    pub message: Message,
    /// The marked map.
    pub marked: Marked,
    patches: Patches,
}

impl ReferenceMarking {
    /// Marks the reference with the current code.
    ///
    /// # Panics
    /// Panics when it cannot be marked.
    pub fn new() -> Self {
        let map = read(&reference_path(), &Selection::default());
        let code = Code::Repetition;
        let parameters = Parameters { code, chip_rate: code.default_chip_rate(), ..Parameters::default() };
        let on_ground = map.map(&parameters).expect("a projected CRS");
        let ground = on_ground.ground.clone();
        let message = key().recipient_message(RECIPIENT);
        let marked = embed(&on_ground, &key(), &message, &parameters).expect("it fits");
        let patches = Patches::new(&on_ground, &parameters).expect("it fits");
        ReferenceMarking { reference: map.data.vertices, ground, parameters, message, marked, patches }
    }

    /// Returns every intermediate value that an implementer may want to compare, by the steps of
    /// the algorithm.
    pub fn steps(&self) -> Value {
        let basis = self.basis(0);
        json!({
            "0_key": { "id": key().id(), "message": self.message.to_hex() },
            "1_vertices": self.vertices(),
            "2_mesh": self.mesh(),
            "3_patches": self.patches(),
            "4_spectrum": {
                "patch_0_eigenvalues": basis.eigenvalues,
                "patch_0_norms_squared": basis.norms_squared[..FIRST],
                "patch_0_columns_1_to_3": (1..=3).map(|i| column(&basis, i)).collect::<Vec<_>>(),
                "patch_0_coordinates_m": self.coordinate_spectrum(&basis),
                "ring_of_12": ring(),
            },
            "5_modulation": self.modulation(&basis),
            "6_marked": self.marked_map(),
            "7_paper_demodulator": self.scores(),
        })
    }

    fn vertices(&self) -> Value {
        let vertices = &self.reference;
        let Ground::Plane { metres_per_unit } = self.ground else { panic!("a projected CRS") };
        json!({
            "count": vertices.len(),
            "sha256": vertices.digest(),
            "first": vertices.coords()[..FIRST],
            "centre": vertices.centre(),
            "metres_per_unit": metres_per_unit,
        })
    }

    fn mesh(&self) -> Value {
        let mesh = Mesh::delaunay(&self.reference.local(1.0)).expect("it is no line");
        json!({ "count": mesh.edges().len(), "first": mesh.edges()[..FIRST] })
    }

    fn patches(&self) -> Value {
        let patches = self.patches.as_slice();
        json!({
            "vertex_counts": patches.iter().map(|p| p.vertices.len()).collect::<Vec<_>>(),
            "edge_counts": patches.iter().map(|p| p.edges.len()).collect::<Vec<_>>(),
            "patch_0_vertices": patches[0].vertices,
            "patch_0_edges": patches[0].edges,
        })
    }

    fn carriers(&self) -> usize {
        self.patches.carriers(self.message.len(), &self.parameters).expect("it fits")
    }

    fn basis(&self, number: usize) -> Basis {
        Basis::low_frequencies(&self.patches.as_slice()[number], self.carriers() + 1).expect("it converges")
    }

    /// Returns the analysis of coordinates relative to the map's centre: the r_i of the paper,
    /// which marking does not need.
    fn coordinate_spectrum(&self, basis: &Basis) -> Value {
        let local = self.reference.local(1.0);
        let axis = |axis: usize| {
            let values: Vec<f64> = self.patch_0().iter().map(|&v| local[v as usize][axis]).collect();
            basis.analyse(&values)[..FIRST].to_vec()
        };
        json!({ "x": axis(0), "y": axis(1) })
    }

    fn modulation(&self, basis: &Basis) -> Value {
        let chips = [0, 1].map(|axis| Carrier::new(&key()).chips(0, axis, self.carriers()));
        let modulated = chips.each_ref().map(|chips| self.coefficients(chips));
        let displacement = modulated.each_ref().map(|values| basis.synthesise(values)[..FIRST].to_vec());
        json!({
            "patch_0_chips": { "x": plus_minus(&chips[0]), "y": plus_minus(&chips[1]) },
            "patch_0_coefficients_m": { "x": modulated[0][..FIRST], "y": modulated[1][..FIRST] },
            "patch_0_displacement_m": { "x": displacement[0], "y": displacement[1] },
        })
    }

    /// Returns α p_i b′_j of one axis, after a 0 for the mean.
    fn coefficients(&self, chips: &[f64]) -> Vec<f64> {
        let signs = self.parameters.code.encode(&self.message);
        let bit = |i: usize| signs[bit_of_coefficient(i + 1, self.parameters.chip_rate)];
        let modulated = chips.iter().enumerate().map(|(i, chip)| self.parameters.amplitude_m * chip * bit(i));
        std::iter::once(0.0).chain(modulated).collect()
    }

    fn marked_map(&self) -> Value {
        let first = self.patch_0()[..FIRST].iter().map(|&v| self.marked.coords[v as usize]);
        json!({
            "patch_0_first": first.collect::<Vec<_>>(),
            "rms_m": self.marked.displacement.rms_m,
            "p99_m": self.marked.displacement.p99_m,
            "max_m": self.marked.displacement.max_m,
        })
    }

    fn patch_0(&self) -> &[u32] {
        &self.patches.as_slice()[0].vertices
    }

    /// Returns what the paper's detector finds in the file marked.gpkg.
    fn scores(&self) -> Value {
        let mut observed = vec![None; self.reference.len()];
        for (from, to) in coordinates(&reference_path()).into_iter().zip(coordinates(&marked_path())) {
            let vertex = self.reference.index_of(from).expect("a vertex of the reference");
            observed[vertex] = Some(self.ground.metres_between(from, to));
        }
        let (carrier, bits) = (Carrier::new(&key()), self.message.len());
        let found = demodulation::paper(&self.patches, &carrier, &observed, bits, &self.parameters, &|_| ())
            .expect("it fits");
        json!({ "message": found.message().to_hex(), "scores_m": found.scores })
    }
}

impl Default for ReferenceMarking {
    fn default() -> Self {
        Self::new()
    }
}

fn column(basis: &Basis, i: usize) -> Vec<f64> {
    (0..basis.vectors.nrows()).map(|v| basis.vectors[(v, i)]).collect()
}

/// Returns the spectrum of a ring of 12 vertices, whose eigenvalues 1 − cos(πk/6) occur twice each:
/// the solver may not choose the basis there.
fn ring() -> Value {
    let mut edges: Vec<[u32; 2]> = (0..11).map(|i| [i, i + 1]).chain([[0, 11]]).collect();
    edges.sort_unstable();
    let patch = Patch { vertices: (0..12).collect(), edges, ..Patch::default() };
    let basis = Basis::low_frequencies(&patch, 5).expect("it converges");
    json!({
        "edges": patch.edges,
        "eigenvalues": basis.eigenvalues,
        "columns": (0..5).map(|i| column(&basis, i)).collect::<Vec<_>>(),
    })
}

pub(crate) fn plus_minus(chips: &[f64]) -> String {
    chips.iter().map(|chip| if *chip > 0.0 { '+' } else { '-' }).collect()
}

/// Returns JSON with one line for every value that is not an object, so that a person can read it.
pub fn to_text(value: &Value) -> String {
    fn write(value: &Value, indent: usize, text: &mut String) {
        let Value::Object(fields) = value else { return text.push_str(&value.to_string()) };
        text.push('{');
        for (i, (name, field)) in fields.iter().enumerate() {
            let comma = if i == 0 { "" } else { "," };
            text.push_str(&format!("{comma}\n{:indent$}\"{name}\": ", "", indent = indent + 2));
            write(field, indent + 2, text);
        }
        text.push_str(&format!("\n{:indent$}}}", ""));
    }
    let mut text = String::new();
    write(value, 0, &mut text);
    text + "\n"
}

/// Returns the places where two documents differ, in a number by more than `tolerance`.
pub fn differences(a: &Value, b: &Value, tolerance: f64) -> Vec<String> {
    fn compare(a: &Value, b: &Value, tolerance: f64, at: &str, found: &mut Vec<String>) {
        match (a, b) {
            (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
                a.iter()
                    .zip(b)
                    .enumerate()
                    .for_each(|(i, (a, b))| compare(a, b, tolerance, &format!("{at}/{i}"), found));
            }
            (Value::Object(a), Value::Object(b))
                if a.len() == b.len() && a.keys().all(|k| b.contains_key(k)) =>
            {
                a.iter().for_each(|(k, v)| compare(v, &b[k], tolerance, &format!("{at}/{k}"), found));
            }
            (Value::Number(x), Value::Number(y))
                if (x.as_f64().unwrap_or(f64::NAN) - y.as_f64().unwrap_or(f64::NAN)).abs() <= tolerance => {}
            _ if a == b => {}
            _ => found.push(format!("{at}: {a} is not {b}")),
        }
    }
    let mut found = Vec::new();
    compare(a, b, tolerance, "", &mut found);
    found
}
