//! Promise: the files of a crate import each other without cycles, except for [`ALLOWED`].
//!
//! An import is a `use` declaration or a path that begins with `crate`, `self`, `super` or a child module, in code
//! outside of tests. Re-exports are followed to the file that defines the item. A child that uses items of its parent
//! or a farther ancestor does not count: every module tree does that.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::{root, sources};

/// Known cycles: the folder of the crate below `crates/`, and its modules, sorted by name.
const ALLOWED: &[(&str, &[&str])] = &[(
    // Methods of `Gpu` and records of its worlds, in a file for each stage.
    "render/chaic-render-gpu",
    &["bodies", "gpu", "lights", "meshes", "records", "render", "upload"],
)];

/// A path of identifiers, such as `crate::memory::Map`; a glob ends in `*`.
type ItemPath = Vec<String>;

/// The imports and items of one source file.
#[derive(Debug, Default)]
struct Module {
    /// Paths in expressions and signatures.
    paths: BTreeSet<ItemPath>,
    /// `use` declarations: the name in this module, and the path.
    uses: Vec<(String, ItemPath)>,
    /// Items that this file defines, with its child modules.
    items: BTreeSet<String>,
}

/// The modules of one crate by their paths; the root has the empty path.
type Crate = BTreeMap<ItemPath, Module>;

/// Splits Rust code into identifiers and punctuation, without comments, literals and lifetimes.
fn tokens(code: &str) -> Vec<String> {
    let chars: Vec<char> = code.chars().collect();
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut found, mut i) = (Vec::new(), 0);
    while i < chars.len() {
        let c = at(i);
        if c == '/' && at(i + 1) == '/' {
            i = (i..chars.len()).find(|&k| at(k) == '\n').unwrap_or(chars.len());
        } else if c == '/' && at(i + 1) == '*' {
            let end = (i + 2..chars.len()).find(|&k| at(k) == '*' && at(k + 1) == '/');
            i = end.map_or(chars.len(), |k| k + 2);
        } else if c == '"' {
            i += 1;
            while i < chars.len() && at(i) != '"' {
                i += if at(i) == '\\' { 2 } else { 1 };
            }
            i += 1;
        } else if c == '\'' {
            i = end_of_quote(&chars, i);
        } else if is_word(c) {
            let end = (i..chars.len()).find(|&k| !is_word(at(k))).unwrap_or(chars.len());
            let word: String = chars[i..end].iter().collect();
            let n_hashes = (end..).take_while(|&k| at(k) == '#').count();
            if ["r", "br"].contains(&word.as_str()) && at(end + n_hashes) == '"' {
                let close: String =
                    std::iter::once('"').chain((0..n_hashes).map(|_| '#')).collect();
                let rest: String = chars[end + n_hashes + 1..].iter().collect();
                let n_inside = rest.find(&close).map_or(rest.len(), |k| k + close.len());
                i = end + n_hashes + 1 + rest[..n_inside].chars().count();
            } else {
                found.push(word);
                i = end;
            }
        } else {
            if c == ':' && at(i + 1) == ':' {
                found.push("::".into());
                i += 1;
            } else if !c.is_whitespace() {
                found.push(c.into());
            }
            i += 1;
        }
    }
    found
}

/// Returns the position after a character literal, or after the quote of a lifetime.
fn end_of_quote(chars: &[char], start: usize) -> usize {
    let at = |i: usize| chars.get(i).copied().unwrap_or('\0');
    if at(start + 1) == '\\' {
        (start + 3..chars.len()).find(|&k| at(k) == '\'').map_or(chars.len(), |k| k + 1)
    } else if at(start + 2) == '\'' {
        start + 3
    } else {
        start + 1
    }
}

/// Returns the position after the block whose `{` is the first at or after `start`, or after a `;` before it.
fn end_of_block(tokens: &[String], start: usize) -> usize {
    let mut depth = 0;
    for (i, token) in tokens.iter().enumerate().skip(start) {
        match token.as_str() {
            ";" if depth == 0 => return i + 1,
            "{" => depth += 1,
            "}" if depth == 1 => return i + 1,
            "}" => depth -= 1,
            _ => {}
        }
    }
    tokens.len()
}

/// Removes modules and imports under `#[cfg(test)]`.
fn without_tests(tokens: Vec<String>) -> Vec<String> {
    let mark = ["#", "[", "cfg", "(", "test", ")", "]"];
    let (mut kept, mut i) = (Vec::new(), 0);
    while i < tokens.len() {
        if tokens[i..].iter().take(mark.len()).eq(mark) {
            i = end_of_block(&tokens, i + mark.len());
        } else {
            kept.push(tokens[i].clone());
            i += 1;
        }
    }
    kept
}

/// Reads a `use` tree from `i`, with the path before it; returns the position after it.
fn use_tree(
    tokens: &[String],
    mut i: usize,
    before: &[String],
    uses: &mut Vec<(String, ItemPath)>,
) -> usize {
    let mut path = before.to_vec();
    while let Some(token) = tokens.get(i) {
        match token.as_str() {
            "::" => i += 1,
            "{" => {
                i += 1;
                while tokens.get(i).is_some_and(|t| t != "}") {
                    i = use_tree(tokens, i, &path, uses);
                    if tokens.get(i).is_some_and(|t| t == ",") {
                        i += 1;
                    }
                }
                return i + 1;
            }
            "as" => {
                uses.push((tokens.get(i + 1).cloned().unwrap_or_default(), path));
                return i + 2;
            }
            "," | ";" | "}" => break,
            "self" if !path.is_empty() => i += 1,
            name => {
                path.push(name.to_owned());
                i += 1;
            }
        }
    }
    if let Some(name) = path.last().cloned() {
        uses.push((name, path));
    }
    i
}

/// Reads one source file.
fn module(code: &str) -> Module {
    let tokens = without_tests(tokens(code));
    let mut module = Module::default();
    let kinds = ["fn", "struct", "enum", "trait", "type", "const", "static", "mod", "union"];
    let mut i = 0;
    while i < tokens.len() {
        let token = tokens[i].as_str();
        let is_start = i == 0 || tokens[i - 1] != "::";
        if token == "use" && tokens.get(i + 1).is_some_and(|t| t != "<") {
            i = use_tree(&tokens, i + 1, &[], &mut module.uses);
            continue;
        }
        if kinds.contains(&token) {
            module.items.extend(tokens.get(i + 1).cloned());
        } else if token == "macro_rules" {
            module.items.extend(tokens.get(i + 2).cloned());
        } else if is_start && tokens.get(i + 1).is_some_and(|t| t == "::") {
            let mut path = vec![token.to_owned()];
            while tokens.get(i + 1).is_some_and(|t| t == "::") {
                let Some(name) = tokens.get(i + 2).filter(|t| t.starts_with(char::is_alphabetic))
                else {
                    break;
                };
                path.push(name.clone());
                i += 2;
            }
            module.paths.insert(path);
        }
        i += 1;
    }
    module
}

/// Reads the crate in this `src` folder.
fn read_crate(src: &Path) -> Crate {
    let mut files = Vec::new();
    sources(src, &mut files);
    let read = |path: &PathBuf| {
        let within = path.strip_prefix(src).expect("below the folder").with_extension("");
        let mut names: ItemPath = within.iter().map(|n| n.to_string_lossy().into()).collect();
        if names.last().is_some_and(|n| n == "mod") || names == ["lib"] {
            names.pop();
        }
        (names, module(&fs::read_to_string(path).expect("a text")))
    };
    files.iter().map(read).collect()
}

/// Resolves a path from the module `from`; returns `None` if it leaves the crate.
fn absolute(modules: &Crate, from: &[String], path: &[String]) -> Option<ItemPath> {
    let mut base = from.to_vec();
    let mut rest = path;
    match path.first()?.as_str() {
        "crate" => {
            base.clear();
            rest = &path[1..];
        }
        "self" => rest = &path[1..],
        "super" => {
            while rest.first().is_some_and(|n| n == "super") {
                base.pop()?;
                rest = &rest[1..];
            }
        }
        child => {
            base.push(child.to_owned());
            if !modules.contains_key(&base) {
                return None;
            }
            rest = &path[1..];
        }
    }
    base.extend_from_slice(rest);
    Some(base)
}

/// Returns the module that defines the item at an absolute path, through at most `depth` re-exports.
fn definer(modules: &Crate, path: &[String], depth: usize) -> Option<ItemPath> {
    let n_module = (0..=path.len()).rev().find(|&n| modules.contains_key(&path[..n]))?;
    let (owner, rest) = path.split_at(n_module);
    let module = &modules[owner];
    let Some(name) = rest.first().filter(|n| *n != "*" && !module.items.contains(*n)) else {
        return Some(owner.to_vec());
    };
    if depth == 0 {
        return Some(owner.to_vec());
    }
    let follow = |target: &[String]| {
        let target = absolute(modules, owner, target)?;
        if target == path { None } else { Some(target) }
    };
    if let Some((_, target)) = module.uses.iter().find(|(n, _)| n == name) {
        let mut target = follow(target)?;
        target.extend_from_slice(&rest[1..]);
        return definer(modules, &target, depth - 1);
    }
    // A glob re-exports what its module defines.
    for (_, target) in module.uses.iter().filter(|(n, _)| n == "*") {
        let Some(mut target) = follow(target) else { continue };
        target.pop();
        let defines = modules.get(&target).is_some_and(|m| m.items.contains(name));
        if defines && target != owner {
            return Some(target);
        }
    }
    Some(owner.to_vec())
}

/// Imports of each module: the module that is used, with the names.
type Imports = BTreeMap<ItemPath, BTreeMap<ItemPath, BTreeSet<String>>>;

/// Returns all imports between the modules of a crate, except for imports from ancestors.
fn imports(modules: &Crate) -> Imports {
    let mut found = Imports::new();
    for (from, module) in modules {
        let used = module.uses.iter().map(|(_, path)| path).chain(&module.paths);
        for path in used {
            let target = absolute(modules, from, path).and_then(|p| definer(modules, &p, 8));
            let Some(target) = target.filter(|t| !from.starts_with(t)) else { continue };
            let name = path.last().cloned().unwrap_or_default();
            found.entry(from.clone()).or_default().entry(target).or_default().insert(name);
        }
    }
    found
}

/// Returns the modules that `start` imports, directly or indirectly.
fn reachable<'a>(imports: &'a Imports, start: &'a ItemPath) -> BTreeSet<&'a ItemPath> {
    let mut found = BTreeSet::new();
    let mut open = vec![start];
    while let Some(from) = open.pop() {
        for to in imports.get(from).into_iter().flat_map(BTreeMap::keys) {
            if found.insert(to) {
                open.push(to);
            }
        }
    }
    found
}

/// Returns the cycles (strongly connected components): maximal sets of modules that reach each other.
fn cycles(imports: &Imports) -> Vec<Vec<ItemPath>> {
    let reached: BTreeMap<&ItemPath, BTreeSet<&ItemPath>> =
        imports.keys().map(|from| (from, reachable(imports, from))).collect();
    let reaches = |a: &ItemPath, b: &ItemPath| reached.get(a).is_some_and(|r| r.contains(b));
    let mut found: Vec<Vec<ItemPath>> = Vec::new();
    for start in imports.keys().filter(|m| reaches(m, m)) {
        if !found.iter().any(|cycle| cycle.contains(start)) {
            let inside = imports.keys().filter(|m| reaches(start, m) && reaches(m, start));
            found.push(inside.cloned().collect());
        }
    }
    found
}

/// Formats a cycle as an entry of [`ALLOWED`], followed by its imports.
fn description(name: &str, cycle: &[ItemPath], imports: &Imports) -> String {
    let list = cycle.iter().map(|m| format!("{:?}", m.join("::"))).collect::<Vec<_>>().join(", ");
    let mut text = format!("(\"{name}\", &[{list}]),\n");
    for from in cycle {
        for (to, names) in imports[from].iter().filter(|(to, _)| cycle.contains(to)) {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let line =
                format!("    {} -> {}: {}\n", from.join("::"), to.join("::"), names.join(", "));
            text.push_str(&line);
        }
    }
    text
}

/// Returns the folders of all crates below `crates/`, as `layer/crate`.
fn crates() -> Vec<String> {
    let names = |folder: &Path| -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder").flatten();
        let folders = entries.filter(|e| e.path().is_dir());
        let mut names: Vec<_> =
            folders.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    let all = root().join("crates");
    let in_layer = |layer: &String| -> Vec<String> {
        names(&all.join(layer)).iter().map(|name| format!("{layer}/{name}")).collect()
    };
    names(&all).iter().flat_map(in_layer).collect()
}

/// Returns the cycles of the crate in `crates/{name}`, and the number of its modules.
fn cycles_of(name: &str) -> (Vec<(Vec<String>, String)>, usize) {
    let modules = read_crate(&root().join("crates").join(name).join("src"));
    let imports = imports(&modules);
    let found = cycles(&imports).into_iter().map(|cycle| {
        (cycle.iter().map(|m| m.join("::")).collect(), description(name, &cycle, &imports))
    });
    (found.collect(), modules.len())
}

#[test]
fn only_listed_cycles_exist() {
    let (mut n_modules, mut wrong) = (0, Vec::new());
    let mut unused: Vec<_> = ALLOWED.to_vec();
    for name in crates() {
        let (found, n) = cycles_of(&name);
        n_modules += n;
        for (cycle, description) in found {
            match unused.iter().position(|(n, listed)| *n == name && *listed == cycle) {
                Some(index) => drop(unused.remove(index)),
                None => wrong.push(description),
            }
        }
    }
    assert!(wrong.is_empty(), "{} new cycles of files:\n{}", wrong.len(), wrong.join("\n"));
    assert!(unused.is_empty(), "these cycles are gone, remove them from ALLOWED: {unused:?}");
    assert!(n_modules > 300, "only {n_modules} modules were found");
}

#[test]
fn a_cycle_through_a_reexport_is_found() {
    let owned = |path: &str| -> ItemPath {
        path.split("::").filter(|n| !n.is_empty()).map(str::to_owned).collect()
    };
    let tree = |files: &[(&str, &str)]| -> Vec<String> {
        let modules = files.iter().map(|(path, code)| (owned(path), module(code))).collect();
        let cycles = cycles(&imports(&modules));
        cycles
            .iter()
            .map(|c| c.iter().map(|m| m.join("::")).collect::<Vec<_>>().join(" "))
            .collect()
    };
    let lib = ("", "mod a; mod b; pub use a::{A, Other as Renamed};");
    let uses_b = ("a", "use crate::b::B; pub struct A(B); pub struct Other;");
    assert_eq!(tree(&[lib, uses_b, ("b", "use crate::Renamed; pub struct B;")]), ["a b"]);
    assert_eq!(tree(&[lib, uses_b, ("b", "pub struct B; fn f() { crate::a::f(); }")]), ["a b"]);
    let comment = "pub struct B; // crate::a::f\nconst TEXT: &str = \"crate::a::f\";";
    assert!(tree(&[lib, uses_b, ("b", comment)]).is_empty());
    let in_test = "pub struct B; #[cfg(test)] mod tests { use crate::a::A; }";
    assert!(tree(&[lib, uses_b, ("b", in_test)]).is_empty());
    // A child may use its parent.
    let parent = ("a", "mod inner; pub struct A; use inner::f;");
    assert!(tree(&[lib, parent, ("a::inner", "use super::A; pub fn f() {}")]).is_empty());
}
