//! How the window looks: one calm dark theme, so that the picture is the brightest thing.

use eframe::egui::style::{HandleShape, ScrollStyle};
use eframe::egui::{
    Color32, Context, CornerRadius, FontData, FontFamily, FontId, FontInsert, FontPriority,
    InsertFontFamily, Margin, Shadow, Stroke, Style, TextStyle, Theme, vec2,
};

/// Behind the panels.
pub const PANEL: Color32 = Color32::from_rgb(27, 30, 36);
/// Behind the picture until there is one.
pub const VIEWPORT: Color32 = Color32::BLACK;
/// Behind graphs and text fields.
pub const WELL: Color32 = Color32::from_rgb(19, 21, 26);
/// Lines between things.
pub const LINE: Color32 = Color32::from_rgb(44, 49, 58);
/// Text to be read.
pub const TEXT: Color32 = Color32::from_rgb(205, 210, 218);
/// Text that only names things.
pub const TEXT_FAINT: Color32 = Color32::from_rgb(139, 147, 160);
/// What can be held, and what is chosen.
pub const ACCENT: Color32 = Color32::from_rgb(110, 176, 200);
/// Something went wrong.
pub const ERROR: Color32 = Color32::from_rgb(233, 136, 120);
/// Something to know: amber, as what did not happen is often said in it.
pub const NOTE: Color32 = Color32::from_rgb(222, 184, 112);
/// The bars of the histogram.
pub const HISTOGRAM: Color32 = Color32::from_rgb(66, 75, 89);

/// The handles of a box, along x, y, z: as the trihedron's axes.
pub const AXES: [Color32; 3] = [
    Color32::from_rgb(226, 122, 110),
    Color32::from_rgb(139, 195, 120),
    Color32::from_rgb(112, 160, 226),
];

/// Space around a panel's contents, points.
pub const PANEL_MARGIN: Margin = Margin { left: 12, right: 12, top: 8, bottom: 10 };

/// Space between rows, points.
pub const ROW_SPACING: f32 = 6.0;

/// Dresses the whole context.
pub fn apply(ctx: &Context) {
    ctx.set_theme(Theme::Dark);
    ctx.style_mut_of(Theme::Dark, dress);
    // The colour picker's button to copy has a picture that the fonts of words do not have.
    ctx.add_font(FontInsert::new(
        "pictures",
        FontData::from_static(epaint_default_fonts::EMOJI_ICON),
        vec![InsertFontFamily { family: FontFamily::Proportional, priority: FontPriority::Lowest }],
    ));
}

fn dress(style: &mut Style) {
    let font = |size| FontId::new(size, FontFamily::Proportional);
    style.text_styles.insert(TextStyle::Body, font(13.0));
    style.text_styles.insert(TextStyle::Button, font(13.0));
    style.text_styles.insert(TextStyle::Small, font(11.0));
    style.text_styles.insert(TextStyle::Heading, font(14.0));
    style.text_styles.insert(TextStyle::Monospace, FontId::new(12.0, FontFamily::Monospace));
    style.interaction.selectable_labels = false;
    style.interaction.tooltip_delay = 0.35;

    let spacing = &mut style.spacing;
    spacing.item_spacing = vec2(8.0, ROW_SPACING);
    spacing.button_padding = vec2(9.0, 3.0);
    spacing.interact_size = vec2(36.0, 22.0);
    spacing.slider_width = 130.0;
    spacing.slider_rail_height = 4.0;
    spacing.combo_width = 130.0;
    // Lists are seen whole, where the window has room for them.
    spacing.default_area_size.y = 640.0;
    spacing.indent = 12.0;
    spacing.tooltip_width = 320.0;
    spacing.menu_margin = Margin::same(6);
    spacing.window_margin = Margin::same(14);
    // Calm bars: those in front of their ground are as bright as text.
    spacing.scroll = ScrollStyle { foreground_color: false, ..ScrollStyle::floating() };

    let visuals = &mut style.visuals;
    visuals.panel_fill = PANEL;
    visuals.window_fill = Color32::from_rgb(32, 35, 42);
    visuals.window_stroke = Stroke::new(1.0, LINE);
    visuals.window_corner_radius = CornerRadius::same(8);
    visuals.menu_corner_radius = CornerRadius::same(6);
    visuals.extreme_bg_color = WELL;
    visuals.faint_bg_color = Color32::from_rgb(31, 34, 41);
    visuals.weak_text_color = Some(TEXT_FAINT);
    visuals.error_fg_color = ERROR;
    visuals.warn_fg_color = NOTE;
    visuals.hyperlink_color = ACCENT;
    visuals.selection.bg_fill = Color32::from_rgb(46, 82, 98);
    visuals.selection.stroke = Stroke::new(1.0, Color32::from_rgb(224, 238, 244));
    visuals.slider_trailing_fill = true;
    visuals.handle_shape = HandleShape::Circle;
    visuals.collapsing_header_frame = false;
    visuals.indent_has_left_vline = false;
    let soft = Shadow { offset: [0, 6], blur: 18, spread: 0, color: Color32::from_black_alpha(90) };
    visuals.window_shadow = soft;
    visuals.popup_shadow = soft;

    let fills = [
        (&mut visuals.widgets.noninteractive, PANEL, TEXT, LINE),
        (&mut visuals.widgets.inactive, Color32::from_rgb(42, 46, 55), TEXT, Color32::TRANSPARENT),
        (&mut visuals.widgets.hovered, Color32::from_rgb(52, 58, 69), Color32::WHITE, LINE),
        (&mut visuals.widgets.active, Color32::from_rgb(58, 66, 79), Color32::WHITE, ACCENT),
        (&mut visuals.widgets.open, Color32::from_rgb(46, 51, 61), Color32::WHITE, LINE),
    ];
    for (widget, fill, text, outline) in fills {
        widget.bg_fill = fill;
        widget.weak_bg_fill = fill;
        widget.fg_stroke = Stroke::new(1.0, text);
        widget.bg_stroke = Stroke::new(1.0, outline);
        widget.corner_radius = CornerRadius::same(5);
        widget.expansion = 0.0;
    }
}
