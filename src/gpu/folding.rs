//! Shaders with their overrides settled: what these rule out is taken from them.
//!
//! Drivers inline every function at each of its calls before they look at what can be reached: of a shader with all kernels
//! in it they hold, and compile, many times what a scene asks for.

use std::collections::HashMap;

use wgpu::naga;
use wgpu::naga::back::PipelineConstants;
use wgpu::naga::back::pipeline_constants::process_overrides;
use wgpu::naga::compact::{KeepUnused, compact};
use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};
use wgpu::naga::{
    Arena, ArraySize, BinaryOperator, Block, Constant, Expression, Function, GlobalVariable,
    Handle, ImageQuery, Literal, LocalVariable, Module, Range, Span, Statement, SwitchCase,
    TypeInner, UnaryOperator,
};

/// The module of a text with the values of its overrides, where all of it holds: else the driver's own checks tell what does
/// not.
pub(super) fn folded(source: &str, constants: &[(&str, f64)]) -> Option<Module> {
    let module = naga::front::wgsl::parse_str(source).ok()?;
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
    let info = validator.validate(&module).ok()?;
    let constants: PipelineConstants =
        constants.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
    let (module, settled_info) = process_overrides(&module, &info, None, &constants).ok()?;
    let mut module = module.into_owned();
    let Module { constants, global_expressions, functions, entry_points, .. } = &mut module;
    let truths: HashMap<Handle<Constant>, bool> = constants
        .iter()
        .filter_map(|(constant, own)| match global_expressions[own.init] {
            Expression::Literal(Literal::Bool(value)) => Some((constant, value)),
            _ => None,
        })
        .collect();
    for (_, function) in functions.iter_mut() {
        fold(function, &truths);
    }
    for entry in entry_points {
        fold(&mut entry.function, &truths);
    }
    // What is left once nothing unused is.
    let mut left = module.clone();
    compact(&mut left, KeepUnused::No);
    let is_left = |global: &GlobalVariable| {
        left.global_variables.iter().any(|(_, other)| other.binding == global.binding)
    };
    let gone = |(global, own): (Handle<GlobalVariable>, &GlobalVariable)| {
        (own.binding.is_some() && !is_left(own)).then_some(global)
    };
    let gone: Vec<_> = module.global_variables.iter().filter_map(gone).collect();
    for (entry, global) in
        (0..module.entry_points.len()).flat_map(|i| gone.iter().map(move |g| (i, *g)))
    {
        // Handles are those of the module whose overrides were settled.
        if !settled_info.get_entry_point(entry)[global].is_empty() {
            touch(&mut module, entry, global);
        }
    }
    compact(&mut module, KeepUnused::No);
    Some(module)
}

/// Asks an entry point for something of what is bound, so that its layout still has a place for it.
fn touch(module: &mut Module, entry: usize, global: Handle<GlobalVariable>) {
    let mut kind = module.global_variables[global].ty;
    let types = &module.types;
    let function = &mut module.entry_points[entry].function;
    let expressions = &mut function.expressions;
    let mut place = expressions.append(Expression::GlobalVariable(global), Span::UNDEFINED);
    let mut first = None;
    loop {
        let (asked, next) = match &types[kind].inner {
            TypeInner::Image { .. } => {
                let query = ImageQuery::Size { level: None };
                (Expression::ImageQuery { image: place, query }, None)
            }
            TypeInner::Array { size: ArraySize::Dynamic, .. } => {
                (Expression::ArrayLength(place), None)
            }
            TypeInner::Array { base, .. } => {
                (Expression::AccessIndex { base: place, index: 0 }, Some(*base))
            }
            TypeInner::Struct { members, .. } => {
                (Expression::AccessIndex { base: place, index: 0 }, Some(members[0].ty))
            }
            _ => (Expression::Load { pointer: place }, None),
        };
        place = expressions.append(asked, Span::UNDEFINED);
        first.get_or_insert(place);
        match next {
            Some(next) => kind = next,
            None => break,
        }
    }
    let emitted = Statement::Emit(Range::new_from_bounds(first.unwrap_or(place), place));
    function.body.splice(0..0, Block::from_vec(vec![emitted]));
    // What has a name is kept.
    function.named_expressions.insert(place, "bound".to_owned());
}

/// Takes branches away that are never taken, until there are no more.
fn fold(function: &mut Function, truths: &HashMap<Handle<Constant>, bool>) {
    // Names of results would keep what was called.
    function.named_expressions.clear();
    loop {
        let known = Known {
            expressions: &function.expressions,
            truths,
            locals: locals(&function.body, &function.expressions, &function.local_variables),
        };
        let mut body = std::mem::take(&mut function.body);
        let mut has_changed = false;
        fold_block(&mut body, &known, &mut has_changed);
        function.body = body;
        if !has_changed {
            return;
        }
    }
}

/// What is known before a function runs.
struct Known<'a> {
    expressions: &'a Arena<Expression>,
    /// Constants, which overrides are once they are settled, that are true or false.
    truths: &'a HashMap<Handle<Constant>, bool>,
    /// Variables that never have but one value: `a && b` leaves such, where a is false.
    locals: HashMap<Handle<LocalVariable>, bool>,
}

impl Known<'_> {
    fn truth(&self, condition: Handle<Expression>) -> Option<bool> {
        match &self.expressions[condition] {
            Expression::Literal(Literal::Bool(value)) => Some(*value),
            Expression::Constant(constant) => self.truths.get(constant).copied(),
            Expression::Load { pointer } => match &self.expressions[*pointer] {
                Expression::LocalVariable(local) => self.locals.get(local).copied(),
                _ => None,
            },
            Expression::Unary { op: UnaryOperator::LogicalNot, expr } => {
                self.truth(*expr).map(|value| !value)
            }
            Expression::Binary { op, left, right } => {
                let sides = [self.truth(*left), self.truth(*right)];
                match op {
                    BinaryOperator::LogicalAnd if sides.contains(&Some(false)) => Some(false),
                    BinaryOperator::LogicalOr if sides.contains(&Some(true)) => Some(true),
                    BinaryOperator::LogicalAnd | BinaryOperator::LogicalOr => {
                        sides[0].and(sides[1])
                    }
                    _ => None,
                }
            }
            _ => None,
        }
    }
}

/// Variables that are stored to, and with nothing but one literal; what is read before that is of no matter.
fn locals(
    body: &Block,
    expressions: &Arena<Expression>,
    variables: &Arena<LocalVariable>,
) -> HashMap<Handle<LocalVariable>, bool> {
    let mut found: HashMap<Handle<LocalVariable>, Option<bool>> = HashMap::new();
    each(body, &mut |statement| {
        let mut note = |local: Handle<LocalVariable>, value: Option<bool>| {
            let known = found.entry(local).or_insert(value);
            if *known != value {
                *known = None;
            }
        };
        match statement {
            Statement::Store { pointer, value } => {
                if let Expression::LocalVariable(local) = &expressions[*pointer] {
                    note(
                        *local,
                        match &expressions[*value] {
                            Expression::Literal(Literal::Bool(value)) => Some(*value),
                            _ => None,
                        },
                    );
                }
            }
            // Whoever is given a pointer may write there.
            Statement::Call { arguments, .. } => {
                for argument in arguments {
                    if let Expression::LocalVariable(local) = &expressions[*argument] {
                        note(*local, None);
                    }
                }
            }
            _ => {}
        }
    });
    found
        .into_iter()
        .filter(|(local, _)| variables[*local].init.is_none())
        .filter_map(|(local, value)| Some((local, value?)))
        .collect()
}

/// Visits the statements of a block, and of those in it.
fn each(block: &Block, visit: &mut impl FnMut(&Statement)) {
    for statement in block.iter() {
        visit(statement);
        match statement {
            Statement::Block(block) => each(block, visit),
            Statement::If { accept, reject, .. } => {
                each(accept, visit);
                each(reject, visit);
            }
            Statement::Switch { cases, .. } => {
                cases.iter().for_each(|case| each(&case.body, visit))
            }
            Statement::Loop { body, continuing, .. } => {
                each(body, visit);
                each(continuing, visit);
            }
            _ => {}
        }
    }
}

/// Whether nothing that follows a statement is reached.
fn ends(statement: &Statement) -> bool {
    let all_end = |block: &Block| block.iter().any(ends);
    match statement {
        Statement::Return { .. } | Statement::Break | Statement::Continue | Statement::Kill => true,
        Statement::Block(block) => all_end(block),
        Statement::If { accept, reject, .. } => all_end(accept) && all_end(reject),
        _ => false,
    }
}

fn fold_block(block: &mut Block, known: &Known<'_>, has_changed: &mut bool) {
    for statement in block.iter_mut() {
        match statement {
            Statement::Block(block) => fold_block(block, known, has_changed),
            Statement::If { condition, accept, reject } => {
                let taken = match known.truth(*condition) {
                    Some(true) => accept,
                    Some(false) => reject,
                    None => {
                        fold_block(accept, known, has_changed);
                        fold_block(reject, known, has_changed);
                        continue;
                    }
                };
                *has_changed = true;
                let mut taken = std::mem::take(taken);
                fold_block(&mut taken, known, has_changed);
                *statement = Statement::Block(taken);
            }
            Statement::Switch { cases, .. } => {
                for SwitchCase { body, .. } in cases {
                    fold_block(body, known, has_changed);
                }
            }
            Statement::Loop { body, continuing, .. } => {
                fold_block(body, known, has_changed);
                fold_block(continuing, known, has_changed);
            }
            _ => {}
        }
    }
    let end = block.iter().position(ends).map_or(block.len(), |at| at + 1);
    if end < block.len() {
        *has_changed = true;
        block.cull(end..);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "
        override kind: u32 = 0u;
        override also: bool = false;
        struct Sizes { many: array<vec4<u32>, 2>, one: f32 }
        @group(0) @binding(0) var<storage, read_write> out: array<f32>;
        @group(0) @binding(1) var<storage, read> only_one: array<u32>;
        @group(0) @binding(2) var<uniform> only_one_sizes: Sizes;
        @group(0) @binding(3) var only_one_picture: texture_2d<f32>;
        @group(0) @binding(4) var<storage, read> nobody: array<u32>;
        fn one(x: f32) -> f32 { return x + 1.0; }
        fn two(x: f32) -> f32 { return x * 2.0; }
        fn three(x: f32) -> f32 { return x * 3.0; }
        fn four(x: f32) -> f32 { return x * 4.0; }
        fn five(x: f32) -> f32 { return x * 5.0; }
        @compute @workgroup_size(1)
        fn run() {
            if kind == 1u {
                out[3] = f32(only_one[0]) + only_one_sizes.one + textureLoad(only_one_picture, vec2(0), 0).x;
            }
            if kind == 1u { let named = one(out[0]); out[0] = named; } else { out[0] = two(out[0]); }
            if (kind == 1u || kind == 2u) && out[1] > 0.0 { out[1] = three(out[1]); }
            if also || out[2] > 0.0 { out[2] = four(out[2]); }
            if also { out[4] = five(out[4]); }
        }";

    fn names(constants: &[(&str, f64)]) -> Vec<String> {
        let module = folded(SOURCE, constants).expect("a module");
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::all());
        let info = validator.validate(&module).expect("it holds");
        // Pipelines have a place for all that the text uses, whatever is left of it.
        let bound = module.global_variables.iter().filter_map(|(handle, global)| {
            let is_used = !info.get_entry_point(0)[handle].is_empty();
            global.binding.as_ref().filter(|_| is_used).map(|binding| binding.binding)
        });
        assert_eq!(bound.collect::<Vec<_>>(), [0, 1, 2, 3], "{constants:?}");
        module.functions.iter().filter_map(|(_, function)| function.name.clone()).collect()
    }

    #[test]
    fn what_overrides_rule_out_is_gone_and_nothing_else() {
        assert_eq!(names(&[]), ["two", "four"]);
        assert_eq!(names(&[("kind", 1.0)]), ["one", "three", "four"]);
        assert_eq!(names(&[("kind", 2.0), ("also", 1.0)]), ["two", "three", "four", "five"]);
        assert!(folded("fn broken(", &[]).is_none());
        assert!(folded(SOURCE, &[("unknown", 1.0)]).is_none());
    }
}
