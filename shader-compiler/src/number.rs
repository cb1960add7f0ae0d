//! Ids that mean the same in every variant of a shader. A compiler numbers its instructions one after the other, so that one constant more shifts all
//! that follow, and two variants have few bytes in common. Here equal instructions get the same number, and variants pack to an eighth of their size
//! before.

use std::collections::HashMap;

use rspirv::binary::{Assemble, ParseState};
use rspirv::dr::{Instruction, Module, Operand, load_words};
use rspirv::spirv::Word;

/// The ids of a shader's variants so far.
#[derive(Default)]
pub struct Numbering {
    known: HashMap<Meaning, Word>,
}

/// The meaning of an id: the words of its instruction, in which ids of earlier ones are renumbered and those of later ones are 0, and the number of
/// equal instructions before it in the module.
type Meaning = (Vec<Word>, u32);

impl Numbering {
    /// The module `words` with other ids: those of equal instructions in the modules before it, and the next free ones.
    ///
    /// # Errors
    /// Words that are no module.
    pub fn renumber(&mut self, words: &[Word]) -> Result<Vec<Word>, ParseState> {
        let mut module = load_words(words)?;
        let new = self.number(&module);
        for instruction in module.all_inst_iter_mut() {
            renumber(instruction, &new);
        }
        if let Some(header) = &mut module.header {
            header.bound = new.values().max().map_or(1, |last| last + 1);
        }
        Ok(module.assemble())
    }

    /// The new id of each old one.
    fn number(&mut self, module: &Module) -> HashMap<Word, Word> {
        let mut new = HashMap::new();
        let mut equal: HashMap<Vec<Word>, u32> = HashMap::new();
        for instruction in module.all_inst_iter() {
            let Some(old) = instruction.result_id else { continue };
            let mut instruction = instruction.clone();
            renumber(&mut instruction, &new);
            let words = instruction.assemble();
            let before = equal.entry(words.clone()).or_default();
            // Ids begin at 1.
            let next = Word::try_from(self.known.len() + 1).unwrap_or(Word::MAX);
            new.insert(old, *self.known.entry((words, *before)).or_insert(next));
            *before += 1;
        }
        new
    }
}

/// Puts the `new` of each id in its place, and 0 where there is none yet.
fn renumber(instruction: &mut Instruction, new: &HashMap<Word, Word>) {
    let put = |id: &mut Word| *id = new.get(id).copied().unwrap_or(0);
    instruction.result_id.iter_mut().chain(&mut instruction.result_type).for_each(put);
    for operand in &mut instruction.operands {
        if let Operand::IdRef(id) | Operand::IdScope(id) | Operand::IdMemorySemantics(id) = operand {
            put(id);
        }
    }
}

/// Returns true if two modules are the same but for the numbers of their ids. Words that are no module are the same as themselves alone.
#[must_use]
pub fn same_but_for_ids(a: &[Word], b: &[Word]) -> bool {
    // Alone, a module is numbered in the order of its instructions.
    let in_order = |words| Numbering::default().renumber(words).ok();
    a == b || a.len() == b.len() && in_order(a).is_some_and(|a| in_order(b) == Some(a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile_source;

    /// The modules of a shader that has a constant and an addition more where `MORE` is on.
    fn plain_and_more() -> [Vec<Word>; 2] {
        let text = "// variants: MORE
            @group(0) @binding(0) var<storage, read_write> numbers: array<u32>;
            @compute @workgroup_size(64)
            fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                var sum = 0u;
                #ifdef MORE
                sum += 7u;
                #endif
                for (var i = 0u; i < id.y; i += 1u) { sum += numbers[i] ^ 3u; }
                numbers[id.x] = sum;
            }";
        let shader = compile_source(("demo.wgsl", text), &[]).unwrap_or_else(|errors| panic!("{}", errors[0]));
        [0, 1].map(|index| shader.variants[index].entry_points[0].spirv.clone())
    }

    /// Counts the instructions of `a` that are in `b` with the same ids.
    fn shared(a: &[Word], b: &[Word]) -> usize {
        let [a, b] = [a, b].map(|words| load_words(words).expect("a module"));
        a.all_inst_iter().filter(|own| b.all_inst_iter().any(|other| own == &other)).count()
    }

    #[test]
    fn variants_have_what_is_equal_in_them_under_the_same_ids() {
        let [plain, more] = plain_and_more();
        let mut numbering = Numbering::default();
        let new = [&plain, &more].map(|module| numbering.renumber(module).expect("a module"));
        let all = load_words(&plain).expect("a module").all_inst_iter().count();
        let (before, after) = (shared(&plain, &more), shared(&new[0], &new[1]));
        // The difference is the one sum that the other variant has twice; the module's bound is no instruction.
        assert!(
            before < all / 2 && after > all * 9 / 10,
            "of {all} instructions {before} were shared, and {after} are"
        );
    }

    #[test]
    fn modules_are_the_same_but_for_ids_if_nothing_else_differs() {
        let [plain, more] = plain_and_more();
        let mut numbering = Numbering::default();
        let [_, renumbered] = [&plain, &more].map(|module| numbering.renumber(module).expect("a module"));
        assert!(renumbered != more && same_but_for_ids(&renumbered, &more) && !same_but_for_ids(&plain, &more));
        // Another number in an instruction, and another id: the last of a store's.
        let mut seven = more.clone();
        *seven.iter_mut().rfind(|word| **word == 7).expect("the constant") = 8;
        assert!(!same_but_for_ids(&seven, &more));
        let mut swapped = more.clone();
        let store = swapped.windows(3).rposition(|words| words[0] == 3 << 16 | 62).expect("an OpStore");
        swapped.swap(store + 1, store + 2);
        assert!(!same_but_for_ids(&swapped, &more));
        assert!(same_but_for_ids(&[1, 2], &[1, 2]) && !same_but_for_ids(&[1, 2], &[1, 3]));
    }
}
