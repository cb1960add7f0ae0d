//! Every Vulkan command that can fail fails once with each of its results, through the layer of `tests/failures-layer`: errors name the command,
//! nothing panics, hangs or is left behind, and the next picture is the same to the last bit. docs/FAILURES.md describes this.

mod cases;
mod incoherent;
mod layer;
mod lost;
mod play;
mod program;
mod registry;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::LazyLock;

use afterlight_failures_layer::{OF_THE_LOADER, commands, table};
use proc_macro2::{TokenStream, TokenTree};

fn project() -> &'static Path {
    Path::new(env!("AFTERLIGHT_ROOT"))
}

fn blesses() -> bool {
    std::env::var("AFTERLIGHT_BLESS").is_ok_and(|value| value == "1")
}

#[test]
fn the_table_is_that_of_the_registry() {
    let cache = std::env::var_os("AFTERLIGHT_CACHE").map_or_else(|| project().join(".cache"), PathBuf::from);
    let Ok(xml) = fs::read_to_string(cache.join("registry/vk.xml")) else {
        eprintln!(
            "SKIPPED: no registry of Vulkan to hold the table of fallible commands against (scripts/fetch-registry)"
        );
        return;
    };
    let (place, table) = (project().join("tests/failures-layer/src/table.rs"), registry::table(&xml));
    if blesses() {
        fs::write(place, table).expect("it can be written");
    } else {
        let own = fs::read_to_string(place).expect("the table");
        assert!(
            own == table,
            "tests/failures-layer/src/table.rs is not what vk.xml says: AFTERLIGHT_BLESS=1 writes it anew"
        );
    }
}

/// All Rust of the program.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()) {
        if entry.is_dir() {
            sources(&entry, found);
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            found.push(entry);
        }
    }
}

/// Collects the names of all methods that are called, and all literals.
fn methods_and_texts(tokens: TokenStream, methods: &mut BTreeSet<String>, texts: &mut BTreeSet<String>) {
    let mut after_dot = false;
    for token in tokens {
        match &token {
            TokenTree::Group(group) => methods_and_texts(group.stream(), methods, texts),
            TokenTree::Ident(name) if after_dot => _ = methods.insert(name.to_string()),
            TokenTree::Literal(text) => _ = texts.insert(text.to_string()),
            _ => {}
        }
        after_dot = matches!(&token, TokenTree::Punct(punct) if punct.as_char() == '.');
    }
}

/// `vkCreateImage` as `ash` names it.
fn of_ash(command: &str) -> String {
    let name = command.trim_start_matches("vk").trim_end_matches(char::is_uppercase);
    let mut snake = String::new();
    for letter in name.chars() {
        if letter.is_ascii_uppercase() && !snake.is_empty() {
            snake.push('_');
        }
        snake.push(letter.to_ascii_lowercase());
    }
    snake
}

/// The methods that the program calls, and its literals.
static OF_THE_PROGRAM: LazyLock<(BTreeSet<String>, BTreeSet<String>)> = LazyLock::new(|| {
    let (mut files, mut methods, mut texts) = (Vec::new(), BTreeSet::new(), BTreeSet::new());
    ["src", "crates"].iter().for_each(|root| sources(&project().join(root), &mut files));
    for file in files {
        let text = fs::read_to_string(&file).expect("a source");
        let tokens = TokenStream::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        methods_and_texts(tokens, &mut methods, &mut texts);
    }
    (methods, texts)
});

#[test]
fn every_command_that_the_program_calls_and_that_can_fail_is_in_the_table() {
    let (methods, texts) = &*OF_THE_PROGRAM;
    let known: BTreeSet<&str> = commands().map(|command| command.name).collect();
    // The table has the core's name of a command with several names.
    let known_methods: BTreeSet<String> = known.iter().map(|name| of_ash(name)).collect();
    let called: Vec<&str> = table::ELSEWHERE.iter().copied().filter(|name| methods.contains(&of_ash(name))).collect();
    // `wait_semaphores` is a member of `vk::SubmitInfo` here, and not vkWaitSemaphores.
    let is_unknown = |name: &&str| *name != "vkWaitSemaphores" && !known_methods.contains(&of_ash(name));
    let unknown: Vec<_> = called.into_iter().filter(is_unknown).collect();
    assert!(unknown.is_empty(), "the program calls what is not in the table of fallible commands: {unknown:?}");
    let called: Vec<&&str> = known.iter().filter(|name| methods.contains(&of_ash(name))).collect();
    assert!(called.len() > 40, "the scan of the sources finds what they call: {called:?}");
    // The commands that errors name. Commands that record return no result; listings name them.
    let named = texts.iter().map(|text| text.trim_matches('"')).filter(|text| is_command(text));
    let said = named.filter(|name| !name.starts_with("vkCmd"));
    let wrong: Vec<&str> = said.filter(|name| !known.contains(name) && !table::ELSEWHERE.contains(name)).collect();
    assert!(wrong.is_empty(), "errors name commands that do not exist, or that cannot fail: {wrong:?}");
}

#[test]
fn every_command_that_the_program_calls_has_a_row_of_cases_on_the_page() {
    let page = fs::read_to_string(project().join("docs/FAILURES.md")).expect("the page");
    let (methods, _) = &*OF_THE_PROGRAM;
    let is_played = |name: &str| page.contains(&format!("\n| `{name}` |")) || cases::OF_WINDOWS.contains(&name);
    let (played, never): (Vec<&str>, Vec<&str>) = commands().map(|own| own.name).partition(|name| is_played(name));
    assert!(played.len() > 50 && never.contains(&OF_THE_LOADER), "{played:?}, {never:?}");
    let called: Vec<&str> = never.into_iter().filter(|name| methods.contains(&of_ash(name))).collect();
    assert!(called.is_empty(), "the program calls what no case lets fail: {called:?}");
}

fn is_command(text: &str) -> bool {
    text.len() > 4
        && text.starts_with("vk")
        && text[2..].starts_with(|letter: char| letter.is_ascii_uppercase())
        && text.chars().all(|letter| letter.is_ascii_alphanumeric())
}
