//! Ids that mean the same in every variant of a shader. A compiler numbers its instructions in order, so one additional constant shifts all later
//! ids, and two variants have few bytes in common. Here equal instructions get the same number, and variants pack to an eighth of their previous
//! size.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::LazyLock;

use rspirv::grammar::{INSTRUCTION_TABLE, LogicalOperand, OperandKind, OperandQuantifier};
use rspirv::spirv::{MAGIC_NUMBER, Op, Word};

/// The ids of a shader's variants so far.
#[derive(Default)]
pub struct Numbering {
    known: HashMap<Meaning, Word>,
}

/// The meaning of an id: the words of its instruction, with renumbered ids for earlier instructions and 0 for later ones, and the number of equal
/// instructions before it in the module.
type Meaning = (Vec<Word>, u32);

impl Numbering {
    /// Renumbers the ids of the module `words`: equal instructions get the same ids as in the modules before it, others the next free ones. Returns
    /// `None` for words that are not a module, and for a module whose execution modes or decorations have ids.
    pub fn renumber(&mut self, words: &[Word]) -> Option<Vec<Word>> {
        let places = IdPositions::of(words)?;
        let new = self.number(words, &places);
        let mut module = words.to_vec();
        for &id in &places.ids {
            module[id] = new.get(&words[id]).copied().unwrap_or(0);
        }
        module[BOUND] = new.values().max().map_or(1, |last| last + 1);
        Some(module)
    }

    /// The new id of each old one.
    fn number(&mut self, words: &[Word], places: &IdPositions) -> HashMap<Word, Word> {
        let mut new = HashMap::new();
        let mut equal: HashMap<Vec<Word>, u32> = HashMap::new();
        for own in &places.results {
            let mut meaning = words[own.words.clone()].to_vec();
            for id in &places.ids[own.ids.clone()] {
                meaning[id - own.words.start] = new.get(&words[*id]).copied().unwrap_or(0);
            }
            let before = equal.entry(meaning.clone()).or_default();
            // Ids begin at 1.
            let next = Word::try_from(self.known.len() + 1).unwrap_or(Word::MAX);
            new.insert(words[own.id], *self.known.entry((meaning, *before)).or_insert(next));
            *before += 1;
        }
        new
    }
}

/// The words before the first instruction.
const HEADER: usize = 5;
/// The header's word that is above all ids.
const BOUND: usize = 3;

/// The operands of each operation, by its number. Parsing each instruction into an object instead made numbering a third of the build script's time.
static OPERANDS: LazyLock<Vec<&[LogicalOperand]>> = LazyLock::new(|| {
    let mut all = Vec::new();
    for instruction in INSTRUCTION_TABLE.iter() {
        let number = instruction.opcode as usize;
        all.resize(all.len().max(number + 1), &[][..]);
        all[number] = instruction.operands;
    }
    all
});

/// The positions of ids among a module's words.
#[derive(Default)]
struct IdPositions {
    ids: Vec<usize>,
    /// The instructions with a result id.
    results: Vec<InstructionWithId>,
}

struct InstructionWithId {
    words: Range<usize>,
    /// The instruction's part of [`IdPositions::ids`].
    ids: Range<usize>,
    /// The place of the result id.
    id: usize,
}

impl IdPositions {
    fn of(words: &[Word]) -> Option<Self> {
        let mut places = Self::default();
        let mut start = HEADER;
        if words.len() < HEADER || words[0] != MAGIC_NUMBER {
            return None;
        }
        while let Some(first) = words.get(start) {
            // The first word contains the instruction's length in words, and the number of the operation.
            let (count, operation) = ((first >> 16) as usize, first & 0xffff);
            let instruction = words.get(..start + count).filter(|_| count != 0)?;
            let ids = places.ids.len();
            let id = places.read(instruction, start + 1, operation, 0)?;
            let ids = ids..places.ids.len();
            places.results.extend(id.map(|id| InstructionWithId { words: start..instruction.len(), ids, id }));
            start = instruction.len();
        }
        Some(places)
    }

    /// Reads an instruction's operands, which are in `words` from `at` to the end and lack the first `skipped` of its grammar. Returns the place of
    /// its result id, if it has one.
    fn read(&mut self, words: &[Word], mut at: usize, operation: Word, skipped: usize) -> Option<Option<usize>> {
        if [Op::DecorateId, Op::ExecutionModeId].iter().any(|op| *op as Word == operation) {
            return None;
        }
        let mut own = None;
        for operand in OPERANDS.get(operation as usize)?.iter().skip(skipped) {
            let repeated = operand.quantifier == OperandQuantifier::ZeroOrMore;
            while let Some(word) = words.get(at) {
                let (this, rest) = (at, at + 1..words.len());
                at += 1;
                match operand.kind {
                    OperandKind::IdResult => {
                        own = Some(this);
                        self.ids.push(this);
                    }
                    OperandKind::IdResultType
                    | OperandKind::IdRef
                    | OperandKind::IdScope
                    | OperandKind::IdMemorySemantics => self.ids.push(this),
                    OperandKind::PairIdRefIdRef => {
                        self.ids.extend([this, this + 1]);
                        at += 1;
                    }
                    OperandKind::PairIdRefLiteralInteger => {
                        self.ids.push(this);
                        at += 1;
                    }
                    OperandKind::PairLiteralIntegerIdRef => {
                        self.ids.push(this + 1);
                        at += 1;
                    }
                    // The last word of a text ends with a zero.
                    OperandKind::LiteralString => at += words[this..].iter().position(|word| word >> 24 == 0)?,
                    OperandKind::LiteralSpecConstantOpInteger => {
                        // An operation within a constant's instruction has neither a type nor a result id.
                        self.read(words, at, *word, 2)?;
                        at = words.len();
                    }
                    // All remaining words are ids.
                    OperandKind::ImageOperands | OperandKind::LiteralExtInstInteger => {
                        self.ids.extend(rest);
                        at = words.len();
                    }
                    // Numbers follow.
                    OperandKind::LiteralContextDependentNumber
                    | OperandKind::MemoryAccess
                    | OperandKind::Decoration
                    | OperandKind::ExecutionMode
                    | OperandKind::LoopControl => at = words.len(),
                    _ => {}
                }
                if !repeated {
                    break;
                }
            }
        }
        (at == words.len()).then_some(own)
    }
}

/// Returns true if two modules are the same except for the numbers of their ids. Words that are not a module equal only themselves.
#[must_use]
pub fn same_but_for_ids(a: &[Word], b: &[Word]) -> bool {
    // Alone, a module is numbered in the order of its instructions.
    let in_order = |words| Numbering::default().renumber(words);
    a == b || a.len() == b.len() && in_order(a).is_some_and(|a| in_order(b) == Some(a))
}

#[cfg(test)]
mod tests {
    use rspirv::binary::Assemble;
    use rspirv::dr::{Operand, load_words};

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
    fn ids_stand_where_a_parser_of_instructions_finds_them() {
        let text = "
            override STEPS: u32 = 2u;
            @group(0) @binding(0) var picture: texture_2d<f32>;
            @group(0) @binding(1) var trilinear: sampler;
            @group(0) @binding(2) var<storage, read_write> total: atomic<u32>;
            @fragment
            fn main(@location(0) at: vec2<f32>, @location(1) @interpolate(flat) kind: u32) -> @location(0) vec4<f32> {
                var color = textureSampleLevel(picture, trilinear, at, 1.0);
                for (var i = 0u; i < 2u * STEPS; i += 1u) { color += textureLoad(picture, vec2<i32>(i32(i)), 0); }
                switch kind {
                    case 1u, 2u: { color = sqrt(color); }
                    default: { color.x = f32(atomicAdd(&total, kind)); }
                }
                return textureSampleGrad(picture, trilinear, at, dpdx(at), dpdy(at)) + color;
            }";
        let shader = compile_source(("demo.wgsl", text), &[]).unwrap_or_else(|errors| panic!("{}", errors[0]));
        let words = &shader.variants[0].entry_points[0].spirv;
        let mut found = words.clone();
        IdPositions::of(words).expect("a module").ids.iter().for_each(|&id| found[id] += 1000);
        let mut parsed = load_words(words).expect("a module");
        for instruction in parsed.all_inst_iter_mut() {
            for operand in &mut instruction.operands {
                if let Operand::IdRef(id) | Operand::IdScope(id) | Operand::IdMemorySemantics(id) = operand {
                    *id += 1000;
                }
            }
            instruction.result_type.iter_mut().chain(&mut instruction.result_id).for_each(|id| *id += 1000);
        }
        assert!(found == parsed.assemble() && found != *words);
        // The inputs are cut off within a store, contain an unknown operation, or lack the magic number.
        let unknown = [&words[..HEADER], &[1 << 16 | 0xfff0]].concat();
        for broken in [&words[..words.len() - 3], &unknown, &words[1..], &[]] {
            assert_eq!(Numbering::default().renumber(broken), None);
        }
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
