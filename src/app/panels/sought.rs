//! What somebody looks for in the side panel, until it has been brought into sight.

use eframe::egui::{Align, Context, Id, Response, Stroke, StrokeKind, Ui, vec2};

use crate::app::theme;

/// How long a row that was sought is marked, seconds.
const MARKED_FOR: f64 = 2.0;

/// Has what is called `name` (a section, or a part of one) brought into sight when it is drawn next.
pub(in crate::app) fn seek(ctx: &Context, name: &str) {
    ctx.data_mut(|data| data.insert_temp(Id::unique(("sought", name)), true));
}

/// Whether it is to be brought into sight: once.
pub(super) fn take_sought(ctx: &Context, name: &str) -> bool {
    ctx.data_mut(|data| data.remove_temp(Id::unique(("sought", name)))).unwrap_or_default()
}

/// A row of the side panel that somebody looks for.
#[derive(Debug, Clone, Copy)]
struct SoughtRow {
    section: &'static str,
    name: &'static str,
    /// Whether its section is being drawn.
    is_here: bool,
    /// Whether it was brought into sight.
    is_seen: bool,
    /// Until when it is marked, seconds.
    until: f64,
}

fn sought_row_id() -> Id {
    Id::unique("sought row")
}

/// Has a row of a section brought into sight and marked for a while when it is drawn next; the section, too, where it has no such row.
pub(in crate::app) fn seek_row(ctx: &Context, section: &'static str, name: &'static str) {
    seek(ctx, section);
    let until = ctx.time() + MARKED_FOR;
    let sought = SoughtRow { section, name, is_here: false, is_seen: false, until };
    ctx.data_mut(|data| data.insert_temp(sought_row_id(), sought));
}

/// The row that was sought and is marked.
pub fn marked_row(ctx: &Context) -> Option<&'static str> {
    let sought = ctx.data(|data| data.get_temp::<SoughtRow>(sought_row_id()))?;
    (sought.is_seen && ctx.time() < sought.until).then_some(sought.name)
}

/// Draws what belongs to a section, whose rows may be sought.
pub(in crate::app) fn in_section_ui<R>(
    ui: &mut Ui,
    section: &str,
    add: impl FnOnce(&mut Ui) -> R,
) -> R {
    let mark = |ui: &Ui, is_here: bool| {
        ui.data_mut(|data| {
            let sought = data.get_temp::<SoughtRow>(sought_row_id());
            if let Some(sought) = sought.filter(|sought| sought.section == section) {
                data.insert_temp(sought_row_id(), SoughtRow { is_here, ..sought });
            }
        });
    };
    mark(ui, true);
    let result = add(ui);
    mark(ui, false);
    result
}

/// Brings a row into sight that is sought, and marks it.
pub(super) fn show_sought(ui: &Ui, name: &str, row: &Response) {
    let sought = ui.data(|data| data.get_temp::<SoughtRow>(sought_row_id()));
    let Some(sought) = sought.filter(|sought| sought.is_here && sought.name == name) else {
        return;
    };
    let left = sought.until - ui.ctx().time();
    if left <= 0.0 {
        ui.data_mut(|data| data.remove::<SoughtRow>(sought_row_id()));
        return;
    }
    if !sought.is_seen {
        take_sought(ui.ctx(), sought.section);
        row.scroll_to_me(Some(Align::Center));
        let seen = SoughtRow { is_seen: true, ..sought };
        ui.data_mut(|data| data.insert_temp(sought_row_id(), seen));
    }
    let around = row.rect.expand2(vec2(4.0, 2.0));
    ui.painter().rect_stroke(around, 3.0, Stroke::new(1.5, theme::ACCENT), StrokeKind::Outside);
    ui.ctx().request_repaint_after_secs(left as f32);
}
