//! Public items have documentation that says something.
//!
//! This takes the place of rustc's lint `missing_docs`, which also demands a line for each field and each variant. Their names
//! often say all there is, and a lint that asks for more gets lines such as "Its name".

use std::collections::HashSet;
use std::fmt::Display;
use std::fs;
use std::mem::take;
use std::path::{Path, PathBuf};

use bittybuzz_builds::shell::root;
use syn::{
    Attribute, Expr, Ident, ImplItem, Item, ItemImpl, ItemTrait, Lit, Meta, TraitItem, Type,
    UseTree, Visibility,
};

/// Documentation that only repeats the kind of an item. Case and the full stop do not matter.
const EMPTY: [&str; 20] = [
    "how many",
    "how it fares",
    "its address",
    "its id",
    "its kind",
    "its length",
    "its name",
    "its number",
    "its place",
    "its profile",
    "its result",
    "its size",
    "its value",
    "the result",
    "the same",
    "what for",
    "what it does",
    "what it says",
    "where",
    "why",
];

/// Returns the lines of documentation in attributes.
fn documentation(attributes: &[Attribute]) -> Vec<String> {
    let documents = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => Some(&pair.value),
        _ => None,
    });
    documents
        .map(|value| match value {
            Expr::Lit(literal) => match &literal.lit {
                Lit::Str(text) => text.value(),
                _ => String::new(),
            },
            // `include_str!` and `concat!`.
            _ => "made by a macro".to_owned(),
        })
        .collect()
}

fn is_documented(attributes: &[Attribute]) -> bool {
    documentation(attributes).iter().any(|line| !line.trim().is_empty())
}

/// Returns true for a module of names from a manual, which is exempt with `#[allow(missing_docs, reason = "...")]`.
fn is_exempt(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        Meta::List(list) if list.path.is_ident("allow") => {
            list.tokens.to_string().contains("missing_docs")
        }
        _ => false,
    })
}

fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

/// A module of a library.
struct Module {
    /// The folder in which its own modules are, which identifies it.
    folder: PathBuf,
    items: Vec<Item>,
    /// True if other crates can name it.
    is_reachable: bool,
}

/// A name of a `pub use`, and the modules from which and to which it is exported.
struct Use {
    name: String,
    from: PathBuf,
    to: PathBuf,
    is_reachable: bool,
}

/// A library: its modules, and the names that other crates can reach.
#[derive(Default)]
struct Library {
    modules: Vec<Module>,
    uses: Vec<Use>,
    /// Modules, types, traits, functions and constants without documentation.
    missing: Vec<String>,
}

impl Library {
    fn read(root: &Path) -> Library {
        let mut library = Library::default();
        let file = syn::parse_file(&fs::read_to_string(root).unwrap()).unwrap();
        library.require(&file.attrs, &"the crate");
        library.add(file.items, root.parent().unwrap(), true);
        library
    }

    fn require(&mut self, attributes: &[Attribute], name: &dyn Display) {
        if !is_documented(attributes) {
            self.missing.push(name.to_string());
        }
    }

    /// Adds a module whose own modules are files in `folder`, and these.
    fn add(&mut self, items: Vec<Item>, folder: &Path, is_reachable: bool) {
        for item in &items {
            match item {
                Item::Use(item) if is_public(&item.vis) => {
                    let export = |name: &Ident, from: &Path| {
                        let (from, to) = (from.to_owned(), folder.to_owned());
                        self.uses.push(Use { name: name.to_string(), from, to, is_reachable });
                    };
                    names(&item.tree, folder, &mut { export });
                }
                Item::Mod(item) if !is_exempt(&item.attrs) => {
                    let folder = folder.join(item.ident.to_string());
                    let is_reachable = is_reachable && is_public(&item.vis);
                    let (attributes, items) = match &item.content {
                        Some((_, items)) => (item.attrs.clone(), items.clone()),
                        None => {
                            let paths = [folder.with_extension("rs"), folder.join("mod.rs")];
                            // Modules of tests and of certain features may be at another path.
                            let Some(path) = paths.iter().find(|path| path.exists()) else {
                                continue;
                            };
                            let file = syn::parse_file(&fs::read_to_string(path).unwrap()).unwrap();
                            ([&item.attrs[..], &file.attrs].concat(), file.items)
                        }
                    };
                    if is_reachable {
                        self.require(&attributes, &item.ident);
                    }
                    self.add(items, &folder, is_reachable);
                }
                _ => {}
            }
        }
        self.modules.push(Module { folder: folder.to_owned(), items, is_reachable });
    }

    /// Finds public items that other crates can reach and that have no documentation.
    fn check(&mut self) {
        let modules = take(&mut self.modules);
        let uses = take(&mut self.uses);
        let exported = exported(&uses);
        let mut types = Vec::new();
        for module in &modules {
            for item in &module.items {
                let Some((visibility, attributes, name)) = head(item) else { continue };
                let name = name.to_string();
                let is_reachable =
                    module.is_reachable || exported.contains(&(&module.folder, &name));
                if is_public(visibility) && is_reachable {
                    self.require(attributes, &name);
                    if let Item::Trait(item) = item {
                        self.check_trait(item);
                    }
                    types.push((name, &module.folder));
                }
            }
        }
        for module in &modules {
            for item in &module.items {
                if let Item::Impl(item) = item
                    && let Type::Path(own) = &*item.self_ty
                    && let Some(name) = own.path.segments.last().map(|last| last.ident.to_string())
                    // The methods of a type are in its module, or in modules of that.
                    && types.iter().any(|(other, at)| *other == name && module.folder.starts_with(at))
                {
                    self.check_impl(item, &name);
                }
            }
        }
    }

    fn check_trait(&mut self, item: &ItemTrait) {
        for inner in &item.items {
            let (attributes, name) = match inner {
                TraitItem::Const(inner) => (&inner.attrs, &inner.ident),
                TraitItem::Fn(inner) => (&inner.attrs, &inner.sig.ident),
                TraitItem::Type(inner) => (&inner.attrs, &inner.ident),
                _ => continue,
            };
            self.require(attributes, &format!("{}::{name}", item.ident));
        }
    }

    fn check_impl(&mut self, item: &ItemImpl, owner: &str) {
        if item.trait_.is_some() {
            return;
        }
        for inner in &item.items {
            let (visibility, attributes, name) = match inner {
                ImplItem::Const(inner) => (&inner.vis, &inner.attrs, &inner.ident),
                ImplItem::Fn(inner) => (&inner.vis, &inner.attrs, &inner.sig.ident),
                _ => continue,
            };
            if is_public(visibility) {
                self.require(attributes, &format!("{owner}::{name}"));
            }
        }
    }
}

/// Returns the modules and names of items in private modules that a `pub use` makes public, if necessary by
/// way of others.
fn exported(uses: &[Use]) -> HashSet<(&Path, &str)> {
    let mut exported = HashSet::new();
    loop {
        let before = exported.len();
        for pair in uses {
            if pair.is_reachable || exported.contains(&(&*pair.to, &*pair.name)) {
                exported.insert((&*pair.from, &*pair.name));
            }
        }
        if exported.len() == before {
            return exported;
        }
    }
}

/// Calls `found` with each name at the end of a `use`, and with the folder of the module that has it.
fn names(tree: &UseTree, folder: &Path, found: &mut impl FnMut(&Ident, &Path)) {
    match tree {
        UseTree::Path(path) if path.ident == "self" => names(&path.tree, folder, found),
        UseTree::Path(path) if path.ident == "crate" => {
            let root = folder.ancestors().find(|folder| folder.ends_with("src"));
            names(&path.tree, root.unwrap(), found);
        }
        UseTree::Path(path) => names(&path.tree, &folder.join(path.ident.to_string()), found),
        UseTree::Name(name) => found(&name.ident, folder),
        UseTree::Rename(name) => found(&name.ident, folder),
        UseTree::Group(group) => group.items.iter().for_each(|tree| names(tree, folder, found)),
        _ => {}
    }
}

/// Returns visibility, attributes and name of an item that needs documentation if it is public.
fn head(item: &Item) -> Option<(&Visibility, &[Attribute], &Ident)> {
    Some(match item {
        Item::Const(item) => (&item.vis, &item.attrs, &item.ident),
        Item::Enum(item) => (&item.vis, &item.attrs, &item.ident),
        Item::Fn(item) => (&item.vis, &item.attrs, &item.sig.ident),
        Item::Static(item) => (&item.vis, &item.attrs, &item.ident),
        Item::Struct(item) => (&item.vis, &item.attrs, &item.ident),
        Item::Trait(item) => (&item.vis, &item.attrs, &item.ident),
        Item::Type(item) => (&item.vis, &item.attrs, &item.ident),
        Item::Union(item) => (&item.vis, &item.attrs, &item.ident),
        _ => return None,
    })
}

/// Returns the sources of a folder and of the folders in it, but tests and outputs of builds.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if path.is_dir() && !matches!(&*name, "target" | "tests") && !name.starts_with('.') {
            found.extend(sources(&path));
        } else if name.ends_with(".rs") {
            found.push(path);
        }
    }
    found
}

#[test]
fn public_items_are_documented() {
    let mut missing = Vec::new();
    let roots: Vec<PathBuf> =
        sources(root()).into_iter().filter(|path| path.ends_with("src/lib.rs")).collect();
    assert!(roots.len() > 30, "{} libraries", roots.len());
    for path in &roots {
        let mut library = Library::read(path);
        library.check();
        let path = path.strip_prefix(root()).unwrap().display();
        missing.extend(library.missing.iter().map(|name| format!("{path}: {name}")));
    }
    assert!(missing.is_empty(), "without documentation:\n{}", missing.join("\n"));
}

#[test]
fn items_without_documentation_are_found() {
    const TEXT: &str = "/// Some.\npub struct A;\npub struct B;\nstruct C;\nimpl B { pub fn d() {} fn e() {} }\n\
        /// A trait.\npub trait F { fn g(); }\nmod h { pub const I: u8 = 0; pub fn hidden() {} }\npub use h::I;\n\
        #[allow(missing_docs, reason = \"names\")]\npub mod j { pub const K: u8 = 0; }\n\
        pub mod l { pub enum M { N } }\n";
    let mut library = Library::default();
    library.add(syn::parse_file(TEXT).unwrap().items, root(), true);
    library.check();
    library.missing.sort();
    assert_eq!(library.missing, ["B", "B::d", "F::g", "I", "M", "l"]);
}

/// Returns the blocks of documentation in a text that say nothing, with their lines.
fn empty(text: &str) -> Vec<(usize, &str)> {
    let lines: Vec<&str> = text.lines().map(str::trim_start).collect();
    let is_document = |line: &&str| line.starts_with("///") || line.starts_with("//!");
    let mut found = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        let is_alone =
            !index.checked_sub(1).and_then(|index| lines.get(index)).is_some_and(is_document)
                && !lines.get(index + 1).is_some_and(is_document);
        let text = line.strip_prefix("///").unwrap_or_default().trim();
        let bare = text.trim_end_matches('.').to_lowercase();
        if is_alone && EMPTY.contains(&bare.as_str()) {
            found.push((index + 1, text));
        }
    }
    found
}

#[test]
fn documentation_says_something() {
    let mut wrong = Vec::new();
    for path in sources(root()) {
        let text = fs::read_to_string(&path).unwrap();
        let path = path.strip_prefix(root()).unwrap().display().to_string();
        wrong.extend(empty(&text).iter().map(|(line, text)| format!("{path}:{line}: {text}")));
    }
    assert!(wrong.is_empty(), "delete these, or state a fact:\n{}", wrong.join("\n"));
}

#[test]
fn empty_documentation_is_found() {
    let text = "    /// Its name.\n    name: u8,\n/// Its name.\n/// At most 8 letters.\n/// Why\nfn f() {}\n/// why.\n";
    assert_eq!(empty(text), [(1, "Its name."), (7, "why.")]);
}
