//! The modules of a crate import each other in one direction: each can be read after those that it
//! uses.
//!
//! The test reads `use` declarations and paths in the code, and follows re-exports to the module
//! that defines an item. It does not see which module implements a method. `mod` declarations and
//! re-exports of children are no imports.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write,
    fs,
    path::Path,
};

const CRATES: [&str; 12] = [
    "core",
    "detection",
    "marking",
    "verification",
    "dataset",
    "plugin",
    "verifier",
    "python",
    "host-tests",
    "studies",
    "benches",
    "cgal",
];

#[test]
fn no_crate_has_a_circle_of_imports() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut found = String::new();
    for name in CRATES {
        let modules = Modules::read(&workspace.join(name).join("src"));
        assert!(modules.0.len() > 1, "{name} has its modules in src");
        modules.circles().iter().for_each(|circle| writeln!(found, "{name}: {circle}").unwrap());
    }
    assert!(found.is_empty(), "modules that import each other:\n{found}");
}

#[test]
fn a_circle_is_found_by_whichever_path_it_closes() {
    let one_way =
        [("lib", "mod a; mod b; pub use b::B;"), ("a", "use crate::B; struct A(B);"), ("b", "struct B;")];
    assert_eq!(circles(&one_way), [""; 0]);
    for b in [
        "use crate::a::A; struct B(A);",
        "use crate::{a::{self, A}, c}; struct B(A);",
        "use super::a::*; struct B;",
        "struct B; impl B { fn f(&self) { crate::a::f() } }",
        "struct B<'a>(&'a str); const A: &str = \"\\\"\"; fn f(c: char) { if c == '\"' { super::a::f() } }",
        "use crate::c::A; struct B(A);",
    ] {
        let mut closed = one_way.to_vec();
        closed[2].1 = b;
        closed.push(("c", "pub use crate::a::A;"));
        let found = circles(&closed);
        assert!(found.len() == 1 && found[0].starts_with("a → b (B)"), "{b}: {found:?}");
    }
    for b in [
        "// use crate::a::A;\nstruct B;",
        "/* /* nested */ use crate::a::A; */ struct B;",
        "const B: &str = \"use crate::a::A;\"; const C: &str = r#\"\"use crate::a::A;\"#;",
        "struct B; #[cfg(test)] mod tests { use crate::a::A; fn f() {} }",
        "struct B; #[cfg(test)] use crate::a::A;",
        "use std::a; struct B;",
    ] {
        let mut open = one_way.to_vec();
        open[2].1 = b;
        assert_eq!(circles(&open), [""; 0], "{b}");
    }
}

#[test]
fn a_folder_declares_its_children_and_uses_them_or_is_used_by_them() {
    let child = ("a::b", "use super::A; struct B(A);");
    for (parent, is_circle) in [
        ("mod b; pub use b::B; struct A;", false),
        ("mod b; use b::B; struct A(B);", true),
        ("mod b; pub use b::B; struct A(B);", true),
        ("mod b; struct A(b::B);", true),
    ] {
        assert_eq!(
            circles(&[("lib", "mod a;"), ("a", parent), child]).len(),
            usize::from(is_circle),
            "{parent}"
        );
    }
}

fn circles(sources: &[(&str, &str)]) -> Vec<String> {
    Modules(sources.iter().map(|(name, text)| (segments(name), Source::parse(text))).collect()).circles()
}

fn segments(name: &str) -> Vec<String> {
    name.split("::").filter(|segment| *segment != "lib").map(String::from).collect()
}

/// The modules of a crate by their paths; the empty path is the root.
struct Modules(BTreeMap<Vec<String>, Source>);

/// The imports of a module, and the rest of its code.
struct Source {
    imports: Vec<Import>,
    code: Vec<String>,
}

#[derive(Debug, Clone)]
struct Import {
    path: Vec<String>,
    /// The name in the module; `*` for all of them.
    name: String,
    is_public: bool,
}

/// The names by which a module uses another.
type Edges = BTreeMap<Vec<String>, BTreeMap<Vec<String>, BTreeSet<String>>>;

impl Modules {
    fn read(src: &Path) -> Self {
        let mut modules = BTreeMap::new();
        let mut folders = vec![(src.to_path_buf(), Vec::new())];
        while let Some((folder, path)) = folders.pop() {
            for entry in fs::read_dir(&folder).unwrap() {
                let file = entry.unwrap().path();
                let stem = file.file_stem().unwrap().to_str().unwrap().to_owned();
                let inner = [path.clone(), vec![stem.clone()]].concat();
                match stem.as_str() {
                    _ if file.is_dir() => folders.push((file, inner)),
                    "main" | "bin" => {} // a crate of its own
                    _ if file.extension().is_none_or(|e| e != "rs") => {}
                    "lib" | "mod" => drop(modules.insert(path.clone(), Source::read(&file))),
                    _ => drop(modules.insert(inner, Source::read(&file))),
                }
            }
        }
        Modules(modules)
    }

    /// Returns groups of modules that reach each other, with the names by which they do.
    fn circles(&self) -> Vec<String> {
        let edges = self.edges();
        let reached: BTreeMap<_, _> = edges.keys().map(|module| (module, reach(&edges, module))).collect();
        let mut described = BTreeSet::new();
        for (module, within) in &reached {
            let circle: Vec<_> = within.iter().filter(|other| reached[**other].contains(*module)).collect();
            let mut text = String::new();
            for from in &circle {
                for (to, names) in edges[**from].iter().filter(|(to, _)| circle.contains(&to)) {
                    let names = names.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
                    let between = if text.is_empty() { "" } else { "; " };
                    write!(text, "{between}{} → {} ({names})", label(from), label(to)).unwrap();
                }
            }
            if circle.len() > 1 {
                described.insert(text);
            }
        }
        described.into_iter().collect()
    }

    fn edges(&self) -> Edges {
        let mut edges: Edges = self.0.keys().map(|module| (module.clone(), BTreeMap::new())).collect();
        for (module, source) in &self.0 {
            let imported = source.imports.iter().filter(|import| self.is_used(module, import));
            let imported = imported.map(|import| (&import.path, import.name.clone()));
            let paths = source.paths();
            let inline = paths.iter().map(|path| (path, path.last().unwrap().clone()));
            for (path, name) in imported.chain(inline) {
                if let Some(target) = self.resolve(module, path).filter(|target| target != module) {
                    edges.get_mut(module).unwrap().entry(target).or_default().insert(name);
                }
            }
        }
        edges
    }

    /// Returns whether a module uses an import. A module that only re-exports a name of its child
    /// does not.
    fn is_used(&self, module: &[String], import: &Import) -> bool {
        let is_childs = self.resolve(module, &import.path).is_some_and(|target| target.starts_with(module));
        !(import.is_public && is_childs) || self.0[module].mentions(&import.name)
    }

    /// Returns the module in which the item of a path is defined; `None` when that is in another
    /// crate.
    fn resolve(&self, module: &[String], path: &[String]) -> Option<Vec<String>> {
        let mut at = module.to_vec();
        for (i, segment) in path.iter().enumerate() {
            let child = [at.clone(), vec![segment.clone()]].concat();
            match segment.as_str() {
                "crate" => at.clear(),
                "self" => {}
                "super" => drop(at.pop()),
                _ if self.0.contains_key(&child) => at = child,
                _ if i == 0 => return None,
                _ => match self.0[&at].imports.iter().find(|import| import.name == *segment) {
                    Some(import) => return self.resolve(&at, &import.path).or(Some(at)),
                    None => return Some(at),
                },
            }
        }
        Some(at)
    }
}

fn reach<'a>(edges: &'a Edges, start: &'a Vec<String>) -> BTreeSet<&'a Vec<String>> {
    let (mut reached, mut waiting) = (BTreeSet::new(), vec![start]);
    while let Some(module) = waiting.pop() {
        waiting.extend(edges[module].keys().filter(|next| reached.insert(*next)));
    }
    reached
}

fn label(module: &[String]) -> String {
    if module.is_empty() { "lib".into() } else { module.join("::") }
}

impl Source {
    fn read(file: &Path) -> Self {
        Self::parse(&fs::read_to_string(file).unwrap())
    }

    fn parse(text: &str) -> Self {
        let tokens = without_tests(tokens(text));
        let (mut imports, mut code) = (Vec::new(), Vec::new());
        let mut rest = tokens.as_slice();
        while let Some((token, after)) = rest.split_first() {
            rest = after;
            // `use<'a>` is a bound.
            if token == "use" && rest.first().is_some_and(|next| next != "<") {
                let end = rest.iter().position(|t| t == ";").expect("a declaration ends");
                let is_public = code.last().is_some_and(|t| t == "pub" || t == ")");
                add_imports(&mut imports, &[], &rest[..end], is_public);
                rest = &rest[end..];
            } else {
                code.push(token.clone());
            }
        }
        Source { imports, code }
    }

    /// Paths of two segments and more.
    fn paths(&self) -> Vec<Vec<String>> {
        let mut paths: Vec<Vec<String>> = vec![Vec::new()];
        let mut continues = false;
        for token in &self.code {
            match (token.as_str(), continues) {
                ("::", _) => continues = true,
                (_, true) if is_word(token) => {
                    paths.last_mut().expect("there is one").push(token.clone());
                    continues = false;
                }
                _ => {
                    paths.push(vec![token.clone()]);
                    continues = false;
                }
            }
        }
        paths.retain(|path| path.len() > 1);
        paths
    }

    fn mentions(&self, name: &str) -> bool {
        self.code
            .iter()
            .zip(self.code.iter().skip(1))
            .any(|(before, token)| token == name && before != "." && before != "mod")
    }
}

/// Adds the imports of a tree like `a::{b, c::{self, d as e}}`.
fn add_imports(imports: &mut Vec<Import>, prefix: &[String], tree: &[String], is_public: bool) {
    let mut path = prefix.to_vec();
    for (i, token) in tree.iter().enumerate() {
        match token.as_str() {
            "::" => {}
            "{" => {
                let branches = &tree[i + 1..tree.len() - 1];
                return split_branches(branches).for_each(|b| add_imports(imports, &path, b, is_public));
            }
            "as" => {
                let name = tree[i + 1].clone();
                return imports.push(Import { path, name, is_public });
            }
            "self" if !path.is_empty() => {}
            _ => path.push(token.clone()),
        }
    }
    let Some(name) = path.last().cloned() else { return };
    path.retain(|segment| segment != "*");
    imports.push(Import { path, name, is_public });
}

fn split_branches(branches: &[String]) -> impl Iterator<Item = &[String]> {
    let mut depth = 0;
    let mut is_comma = move |token: &String| {
        depth += i32::from(token == "{") - i32::from(token == "}");
        token == "," && depth == 0
    };
    branches.split(move |token| is_comma(token)).filter(|branch| !branch.is_empty())
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphanumeric() || c == '_')
}

/// Returns the tokens without items that are compiled for tests alone.
fn without_tests(tokens: Vec<String>) -> Vec<String> {
    const CFG_TEST: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut kept = Vec::new();
    let mut rest = tokens.as_slice();
    while let Some(token) = rest.first() {
        if rest.len() > CFG_TEST.len() && rest.iter().zip(CFG_TEST).all(|(token, wanted)| token == wanted) {
            let mut depth = 0;
            let ends = |token: &String| {
                depth += i32::from(token == "{") - i32::from(token == "}");
                depth == 0 && (token == ";" || token == "}")
            };
            let end = rest.iter().position(ends).expect("an item ends");
            rest = &rest[end + 1..];
        } else {
            kept.push(token.clone());
            rest = &rest[1..];
        }
    }
    kept
}

/// Words and marks of a source text; comments and literals are left out.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let word = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
        let length = match first {
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("/*") => block_comment(rest),
            '"' => string(rest),
            '\'' => character(rest),
            'r' | 'b' | 'c' if is_raw_string(rest) => raw_string(rest),
            ':' if rest.starts_with("::") => 2,
            _ if word > 0 => word,
            _ => first.len_utf8(),
        };
        let token = &rest[..length];
        let is_code = is_word(token) && !token.ends_with(['"', '#']);
        let is_mark = length == first.len_utf8() && !first.is_whitespace() && first != '\'';
        if is_code || is_mark || token == "::" {
            tokens.push(token.to_owned());
        }
        rest = &rest[length..];
    }
    tokens
}

/// Returns the length of a comment that may hold others.
fn block_comment(text: &str) -> usize {
    let mut depth = 0;
    for (i, pair) in text.as_bytes().windows(2).enumerate() {
        match pair {
            b"/*" => depth += 1,
            b"*/" => depth -= 1,
            _ => {}
        }
        if depth == 0 && i > 0 {
            return i + 2;
        }
    }
    text.len()
}

fn string(text: &str) -> usize {
    let mut is_escaped = false;
    let ends = |(_, c): &(usize, char)| {
        let ends = *c == '"' && !is_escaped;
        is_escaped = *c == '\\' && !is_escaped;
        ends
    };
    text.char_indices().skip(1).find(ends).map_or(text.len(), |(i, _)| i + 1)
}

/// Returns the length of a character, or of the mark that begins a lifetime.
fn character(text: &str) -> usize {
    let mut chars = text.char_indices().skip(1);
    match (chars.next(), chars.next()) {
        (Some((_, '\\')), Some((i, c))) => {
            let after = i + c.len_utf8();
            text[after..].find('\'').map_or(text.len(), |end| after + end + 1)
        }
        (Some(_), Some((i, '\''))) => i + 1,
        _ => 1,
    }
}

fn is_raw_string(text: &str) -> bool {
    let after = text.trim_start_matches(['b', 'c']);
    after.strip_prefix('r').is_some_and(|after| after.trim_start_matches('#').starts_with('"'))
}

fn raw_string(text: &str) -> usize {
    let start = text.find('"').expect("it is one");
    let hashes = text[..start].matches('#').count();
    let end = format!("\"{}", "#".repeat(hashes));
    text[start + 1..].find(&end).map_or(text.len(), |i| start + 1 + i + end.len())
}
