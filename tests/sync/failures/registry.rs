//! The table of commands that can fail, `tests/failures-layer/src/table.rs`, written from the registry of Vulkan.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use roxmltree::{Document, Node, ParsingOptions};

/// Versions and extensions that the program uses: their commands and their results are in the table.
const FEATURES: [&str; 2] = ["VK_VERSION_1_0", "VK_VERSION_1_1"];
const EXTENSIONS: [&str; 7] = [
    "VK_KHR_surface",
    "VK_KHR_swapchain",
    "VK_KHR_xcb_surface",
    "VK_KHR_xlib_surface",
    "VK_KHR_wayland_surface",
    "VK_EXT_headless_surface",
    "VK_EXT_debug_utils",
];
/// Single commands of later versions that the program calls by the names of their extensions. Other names of these commands are aliases.
const COMMANDS: [&str; 2] = ["vkCreateRenderPass2", "vkQueueSubmit2"];

/// Commands whose functions in the layer are written by hand, and one of the loader alone, for which no layer is asked.
const BY_HAND: [&str; 9] = [
    "vkCreateInstance",
    "vkDestroyInstance",
    "vkCreateDevice",
    "vkDestroyDevice",
    "vkQueuePresentKHR",
    "vkEnumerateInstanceVersion",
    "vkEnumerateInstanceLayerProperties",
    "vkEnumerateInstanceExtensionProperties",
    "vkEnumerateDeviceLayerProperties",
];

/// A parameter of a command, as C has it.
struct Parameter {
    name: String,
    text: String,
    len: Option<String>,
}

/// The table as Rust.
pub fn table(xml: &str) -> String {
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document = Document::parse_with_options(xml, options).unwrap_or_else(|error| panic!("vk.xml: {error}"));
    let root = document.root_element();
    let parts: Vec<Node<'_, '_>> = root.descendants().filter(is_chosen).collect();
    let required = parts.iter().flat_map(|part| required(*part, "command", "name"));
    let chosen: BTreeSet<&str> = required.chain(COMMANDS).collect();
    let mut results: BTreeSet<&str> = parts.iter().flat_map(|part| added_results(*part)).collect();
    results.extend(core_results(root));
    let mut commands: Vec<Node<'_, '_>> = root.descendants().filter(is_command).collect();
    commands.sort_by_key(|command| name_of(*command));

    let [mut fallible, mut frees, mut by_hand] = [const { String::new() }; 3];
    let mut elsewhere = BTreeSet::new();
    for command in commands {
        let name = name_of(command);
        let errors = codes(command, "errorcodes", &results);
        if !chosen.contains(name.as_str()) {
            if !errors.is_empty() {
                elsewhere.insert(name);
            }
            continue;
        }
        let parameters = parameters(command);
        let has_callbacks = parameters.iter().any(|own| own.text.contains("VkAllocationCallbacks"));
        if errors.is_empty() && !has_callbacks {
            continue;
        }
        let codes = (errors, codes(command, "successcodes", &results));
        let _ = match (BY_HAND.contains(&name.as_str()), codes.0.is_empty()) {
            (true, _) => writeln!(by_hand, "    {name} {{ {} }}", facts(&codes)),
            (false, true) => writeln!(frees, "    {}", signature(&name, &parameters)),
            (false, false) => {
                let details = details(&parameters);
                writeln!(
                    fallible,
                    "    {} {{\n        {}{details}\n    }}",
                    signature(&name, &parameters),
                    facts(&codes)
                )
            }
        };
    }
    let elsewhere: String = elsewhere.iter().map(|name| format!("    \"{name}\",\n")).collect();
    format!(
        "//! The commands of Vulkan that can fail, and those that free what others made. Written from vk.xml {} by the test\n\
         //! `failures::the_table_is_that_of_the_registry` with `AFTERLIGHT_BLESS=1`.\n\n\
         use ash::vk;\n\n\
         fallible! {{\n{fallible}}}\n\n\
         by_hand! {{\n{by_hand}}}\n\n\
         frees! {{\n{frees}}}\n\n\
         /// The other commands of Vulkan that can fail. The layer does not know them, and the program does not call them.\n\
         pub const ELSEWHERE: &[&str] = &[\n{elsewhere}];\n",
        version(root)
    )
}

fn is_chosen(node: &Node<'_, '_>) -> bool {
    let name = node.attribute("name").unwrap_or_default();
    node.has_tag_name("feature") && FEATURES.contains(&name)
        || node.has_tag_name("extension") && EXTENSIONS.contains(&name)
}

/// Returns the names that a feature or an extension requires, including names that it requires only together with another part of Vulkan.
fn required<'a>(part: Node<'a, 'a>, tag: &'a str, attribute: &'a str) -> impl Iterator<Item = &'a str> {
    let requires = part.children().filter(|node| node.has_tag_name("require"));
    let own = requires.flat_map(|require| require.children()).filter(move |node| node.has_tag_name(tag));
    own.filter_map(move |node| node.attribute(attribute))
}

fn added_results<'a>(part: Node<'a, 'a>) -> impl Iterator<Item = &'a str> {
    let added = part.descendants().filter(|node| node.attribute("extends") == Some("VkResult"));
    added.filter_map(|node| node.attribute("name"))
}

fn core_results<'a>(root: Node<'a, 'a>) -> impl Iterator<Item = &'a str> {
    let results =
        root.descendants().filter(|node| node.has_tag_name("enums") && node.attribute("name") == Some("VkResult"));
    results.flat_map(|node| node.children()).filter_map(|node| node.attribute("name"))
}

fn is_for_vulkan(node: &Node<'_, '_>) -> bool {
    node.attribute("api").is_none_or(|api| api.split(',').any(|api| api == "vulkan"))
}

fn is_command(node: &Node<'_, '_>) -> bool {
    // A command itself: neither an alias nor a name in a list of requirements.
    node.has_tag_name("command") && node.children().any(|child| child.has_tag_name("proto")) && is_for_vulkan(node)
}

fn name_of(command: Node<'_, '_>) -> String {
    let proto = command.children().find(|child| child.has_tag_name("proto"));
    let name = proto.and_then(|proto| proto.children().find(|child| child.has_tag_name("name")));
    name.and_then(|name| name.text()).expect("each command has a name").to_owned()
}

fn version(root: Node<'_, '_>) -> String {
    // `#define VK_HEADER_VERSION 309` and `#define VK_HEADER_VERSION_COMPLETE VK_MAKE_API_VERSION(0, 1, 4, VK_HEADER_VERSION)`.
    let define = |name: &str| {
        let own = root.descendants().filter(is_for_vulkan).find(|node| {
            node.has_tag_name("type")
                && node.children().any(|child| child.has_tag_name("name") && child.text() == Some(name))
        });
        let own = own.unwrap_or_else(|| panic!("vk.xml has {name}"));
        own.descendants().filter(Node::is_text).filter_map(|node| node.text()).collect::<String>()
    };
    let number = |text: &str| text.chars().filter(char::is_ascii_digit).collect::<String>();
    let patch = define("VK_HEADER_VERSION");
    let complete = define("VK_HEADER_VERSION_COMPLETE");
    let numbers: Vec<&str> = complete.rsplit('(').next().unwrap_or_default().split(',').collect();
    let patch = patch.lines().last().unwrap_or_default();
    format!("{}.{}.{}", number(numbers[1]), number(numbers[2]), number(patch))
}

/// Returns a command's results, without `VK_`, as far as this part of Vulkan has them.
fn codes(command: Node<'_, '_>, attribute: &str, results: &BTreeSet<&str>) -> Vec<String> {
    let all = command.attribute(attribute).unwrap_or_default().split(',');
    let own = all.filter(|code| results.contains(code) && *code != "VK_SUCCESS");
    own.map(|code| code.trim_start_matches("VK_").to_owned()).collect()
}

fn parameters(command: Node<'_, '_>) -> Vec<Parameter> {
    let own = command.children().filter(|child| child.has_tag_name("param") && is_for_vulkan(child));
    let parameter = |own: Node<'_, '_>| {
        let name = own.children().find(|child| child.has_tag_name("name")).and_then(|name| name.text());
        let text: String =
            own.children().filter(|child| !child.has_tag_name("name")).filter_map(|child| child.text()).collect();
        Parameter {
            name: name.expect("each parameter has a name").to_owned(),
            text: text.split_whitespace().collect::<Vec<_>>().join(" ").replace(" *", "*"),
            len: own.attribute("len").map(str::to_owned),
        }
    };
    own.map(parameter).collect()
}

fn signature(name: &str, parameters: &[Parameter]) -> String {
    let arguments: Vec<String> =
        parameters.iter().map(|own| format!("{}: {}", snake(&own.name), rust_type(&own.text))).collect();
    format!("{name}: PFN_{name}({})", arguments.join(", "))
}

fn facts((errors, successes): &(Vec<String>, Vec<String>)) -> String {
    format!("errors [{}], successes [{}]", errors.join(", "), successes.join(", "))
}

/// The parameters that the layer looks at: callbacks, a list that is told in parts, handles.
fn details(parameters: &[Parameter]) -> String {
    let callbacks = parameters.iter().find(|own| own.text.contains("VkAllocationCallbacks"));
    let mut details = callbacks.map_or_else(String::new, |own| format!(", callbacks {}", snake(&own.name)));
    for own in parameters.iter().filter(|own| !own.text.starts_with("const ")) {
        let Some(len) = &own.len else { continue };
        if parameters.iter().any(|count| count.name == *len && count.text.ends_with('*')) {
            let _ = write!(details, ", list {} {}", snake(len), snake(&own.name));
        } else if own.text.starts_with("Vk") {
            // Handles, which are null where they could not be made.
            let count = match len.split_once("->") {
                Some((pointer, field)) => format!("(*{}).{}", snake(pointer), snake(field)),
                None => snake(len),
            };
            let _ = write!(details, ", handles {} ({count})", snake(&own.name));
        }
    }
    details
}

/// `pCreateInfo` as `create_info`, without a keyword of Rust.
fn snake(name: &str) -> String {
    let mut snake = String::new();
    for (index, letter) in name.char_indices() {
        if letter.is_ascii_uppercase() && index > 0 {
            snake.push('_');
        }
        snake.push(letter.to_ascii_lowercase());
    }
    let snake = snake.strip_prefix("pp_").or_else(|| snake.strip_prefix("p_")).unwrap_or(&snake);
    if snake == "type" { "kind".to_owned() } else { snake.to_owned() }
}

/// Endings of types that have a lifetime in `ash`, since they may point to more.
const CHAINED: [&str; 3] = ["Info", "AllocationCallbacks", "Properties2"];

fn rust_type(c: &str) -> String {
    let (constant, c) = c.strip_prefix("const ").map_or((false, c), |rest| (true, rest));
    let pointers = c.chars().filter(|letter| *letter == '*').count();
    let own = match c.trim_end_matches('*').trim() {
        "void" => "c_void".to_owned(),
        "char" => "c_char".to_owned(),
        "uint32_t" => "u32".to_owned(),
        "uint64_t" => "u64".to_owned(),
        "size_t" => "usize".to_owned(),
        "VkDeviceSize" => "vk::DeviceSize".to_owned(),
        vk => {
            let name = vk.trim_start_matches("Vk");
            let base = ["KHR", "EXT"]
                .iter()
                .fold(name, |name, tag| name.trim_end_matches(tag))
                .trim_end_matches(char::is_numeric);
            let is_chained = CHAINED.iter().any(|end| name.ends_with(end))
                || base.ends_with("Info")
                || ["MappedMemoryRange", "PhysicalDeviceGroupProperties", "DeviceGroupPresentCapabilitiesKHR"]
                    .contains(&name);
            format!("vk::{name}{}", if is_chained { "<'_>" } else { "" })
        }
    };
    let pointer = if constant { "*const " } else { "*mut " };
    format!("{}{own}", pointer.repeat(pointers))
}
