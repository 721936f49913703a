//! The world of a picture: its border, paint, obstacles and lights.

use crate::scenario::{Outline, Shape, WorldSection};

use super::svg::Svg;

/// Longer side of the world in the picture.
const SIDE: f64 = 900.0;
const MARGIN: f64 = 10.0;

/// The gray of black paint, light enough that trajectories are visible on it.
const BLACK: f64 = 80.0;

/// The picture of a world, on which robots can be drawn.
pub struct Backdrop {
    /// Half the extent of the world in mm.
    half: [f64; 2],
    /// Units of the picture per mm.
    pub scale: f64,
}

impl Backdrop {
    /// Draws a world. Returns the picture and its scale.
    pub fn draw(world: &WorldSection) -> (Svg, Backdrop) {
        let [width, height] = world.size;
        let scale = SIDE / width.max(height);
        let backdrop = Backdrop { half: [width / 2.0, height / 2.0], scale };
        let mut svg = Svg::new(width * scale + 2.0 * MARGIN, height * scale + 2.0 * MARGIN);
        backdrop.put_paint(&mut svg, world);
        svg.put(format_args!(
            "<rect x=\"{MARGIN}\" y=\"{MARGIN}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"black\"/>\n",
            width * scale,
            height * scale
        ));
        for light in &world.lights {
            let [x, y] = backdrop.place(light.at);
            svg.put(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\" fill=\"gold\"/>\n"));
        }
        for obstacle in &world.obstacles {
            match obstacle.outline {
                Outline::Shape(shape) => backdrop.fill(&mut svg, shape, "silver"),
                Outline::Wall(from, to) => {
                    let ends = [backdrop.place(from), backdrop.place(to)];
                    svg.line(ends.into_iter(), "black", 2.0);
                }
            }
        }
        (svg, backdrop)
    }

    /// Returns the place in the picture of a place in mm.
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [half_width, half_height] = self.half;
        [MARGIN + (x + half_width) * self.scale, MARGIN + (half_height - y) * self.scale]
    }

    fn put_paint(&self, svg: &mut Svg, world: &WorldSection) {
        if world.ground.is_empty() {
            return;
        }
        // Paint may reach beyond the world.
        svg.put(format_args!(
            "<clipPath id=\"world\"><rect x=\"{MARGIN}\" y=\"{MARGIN}\" width=\"{:.1}\" height=\"{:.1}\"/></clipPath>\n\
             <g clip-path=\"url(#world)\">\n",
            2.0 * self.half[0] * self.scale,
            2.0 * self.half[1] * self.scale
        ));
        for patch in &world.ground {
            let gray = BLACK + (255.0 - BLACK) * patch.brightness;
            self.fill(svg, patch.shape, &format!("rgb({gray:.0},{gray:.0},{gray:.0})"));
        }
        svg.put(format_args!("</g>\n"));
    }

    /// Fills a shape with a color.
    fn fill(&self, svg: &mut Svg, shape: Shape, color: &str) {
        match shape {
            Shape::Disc { at, radius } => {
                let ([x, y], radius) = (self.place(at), radius * self.scale);
                svg.put(format_args!(
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{color}\"/>\n"
                ));
            }
            Shape::Block { at, size, heading } => {
                let ([x, y], [width, height]) =
                    (self.place(at), size.map(|side| side * self.scale));
                let (left, top) = (x - width / 2.0, y - height / 2.0);
                // A positive angle is clockwise in SVG.
                let turn = match heading {
                    0.0 => String::new(),
                    _ => format!(" transform=\"rotate({} {x:.1} {y:.1})\"", -heading),
                };
                svg.put(format_args!(
                    "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" \
                     fill=\"{color}\"{turn}/>\n"
                ));
            }
        }
    }
}
