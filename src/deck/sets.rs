//! Validation of the sets of a deck.

use super::grammar::{self, Deck, Text};
use super::resolve::Scope;
use super::shapes;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::expression::POSITION;
use crate::points::id_file;
use crate::problem;

/// Return the sets of a problem: `all`, the bodies, and the sets of the deck.
///
/// # Errors
/// On a name that is already used, and on an invalid selector.
pub fn sets(scope: &Scope, deck: &Deck) -> Result<Vec<problem::Set>> {
    let mut sets = vec![problem::Set {
        name: "all".to_owned(),
        span: 0..0,
        selector: problem::Selector::All,
    }];
    for (index, (name, body)) in deck.body.iter().enumerate() {
        if name == "all" {
            let message = "[body.all]: `all` is the set of all points; choose another name";
            return Err(scope.error(body.span(), message));
        }
        sets.push(problem::Set {
            name: name.clone(),
            span: body.span(),
            selector: problem::Selector::Body(index),
        });
    }
    for (name, table) in &deck.set {
        if sets.iter().any(|set| set.name == *name) {
            let message = format!(
                "[set.{name}]: this name is taken; `all` and the names of the bodies are sets \
                 already"
            );
            return Err(scope.error(table.span(), message));
        }
        sets.push(problem::Set {
            name: name.clone(),
            span: table.span(),
            selector: selector(scope, deck, name, table)?,
        });
    }
    Ok(sets)
}

fn selector(
    scope: &Scope,
    deck: &Deck,
    name: &str,
    table: &Spanned<grammar::Set>,
) -> Result<problem::Selector> {
    let key = format!("[set.{name}]");
    let set = table.get_ref();
    let given = [
        ("where", set.condition.as_ref().map(Spanned::span)),
        ("shape", set.shape.as_ref().map(Spanned::span)),
        ("ids", set.ids.as_ref().map(Spanned::span)),
        ("file", set.file.as_ref().map(Spanned::span)),
        ("mesh", set.mesh.as_ref().map(Spanned::span)),
    ];
    scope.exactly_one(table.span(), &key, &given)?;
    if let (Some(first), None) = (&set.first_id, &set.file) {
        let message = format!("{key} first_id: is only for a set with `file`");
        return Err(scope.error(first.span(), message));
    }
    if let Some(condition) = &set.condition {
        scope
            .expression(condition, &format!("{key} where"), &POSITION)
            .map(problem::Selector::Where)
    } else if let Some(shape) = &set.shape {
        shapes::shape(scope, &format!("{key} shape"), shape).map(problem::Selector::Within)
    } else if let Some(group) = &set.mesh {
        let is_mesh = |body: &Spanned<grammar::Body>| {
            let points = body.get_ref().points.as_ref();
            points.is_some_and(|points| points.get_ref().mesh.is_some())
        };
        if !deck.body.values().any(is_mesh) {
            let message = format!("{key} mesh: no body has its points from a mesh");
            return Err(scope.error(group.span(), message));
        }
        let set = problem::MeshSet::new(group.get_ref().0.clone(), group.span());
        Ok(problem::Selector::Mesh(set))
    } else if let Some(file) = &set.file {
        let folder = scope.source.path.parent().unwrap_or("".as_ref());
        let first = match &set.first_id {
            Some(first) => scope.whole(first, &format!("{key} first_id"))?,
            None => 0,
        };
        let path = folder.join(file.get_ref());
        let ids = id_file::read(&path, first)
            .map_err(|message| scope.error(file.span(), format!("{key} file: {message}")))?;
        Ok(problem::Selector::Ids {
            ids,
            file: Some(problem::IdFile { path, first }),
            largest: file.span(),
        })
    } else {
        let given = set.ids.as_ref().map_or(&[][..], |ids| ids.get_ref());
        if let Some(id) = given.iter().find(|id| *id.get_ref() > i64::MAX as u64) {
            let message = format!("{key} ids: no point has the id {}", id.get_ref());
            return Err(scope.error(id.span(), message));
        }
        let mut ids: Vec<u64> = given.iter().map(|id| *id.get_ref()).collect();
        ids.sort_unstable();
        ids.dedup();
        let largest = given.iter().max_by_key(|id| *id.get_ref());
        Ok(problem::Selector::Ids {
            ids,
            file: None,
            largest: largest.map_or(table.span(), Spanned::span),
        })
    }
}

/// Return the index of a set.
///
/// # Errors
/// On an unknown set.
pub fn find_set(scope: &Scope, name: &Text, sets: &[problem::Set], key: &str) -> Result<usize> {
    let names = sets.iter().map(|set| set.name.as_str());
    scope.find_used("set", name, names, key)
}

/// Return the indices of several sets.
///
/// # Errors
/// On an unknown set.
pub fn find_sets(
    scope: &Scope,
    names: &[Text],
    sets: &[problem::Set],
    key: &str,
) -> Result<Vec<usize>> {
    names
        .iter()
        .map(|name| find_set(scope, name, sets, key))
        .collect()
}
