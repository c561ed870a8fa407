//! Materials: the common profile's colours, and the scattering that the course's profiles add.

use super::document::{Document, Node, clip, is_course_technique};
use crate::error::{Note, Result};
use crate::scene::description::{MaterialDescription, Surface};
use glam::Vec3;
use roxmltree::NodeId;
use std::collections::HashMap;

/// Albedo where the file states none: no material, or a texture.
const MID_GREY: Vec3 = Vec3::splat(0.5);

/// Reads materials, each once, and numbers them in order of first use.
pub(super) struct Materials<'d, 'a> {
    document: &'d Document<'a>,
    by_element: HashMap<NodeId, u32>,
    effects: HashMap<NodeId, Effect>,
    default: Option<u32>,
    /// All materials in use.
    pub descriptions: Vec<MaterialDescription>,
}

/// What an effect says about a surface.
#[derive(Clone)]
struct Effect {
    surface: Surface,
    emission: Vec3,
}

impl<'d, 'a> Materials<'d, 'a> {
    /// None read yet.
    pub fn new(document: &'d Document<'a>) -> Self {
        let (by_element, effects) = (HashMap::new(), HashMap::new());
        Materials { document, by_element, effects, default: None, descriptions: Vec::new() }
    }

    /// The number of the default material: grey, diffuse.
    pub fn default_material(&mut self) -> u32 {
        if let Some(index) = self.default {
            return index;
        }
        let index = self.add(MaterialDescription {
            name: "(default)".into(),
            at: crate::error::At::File,
            surface: Surface::Diffuse { albedo: MID_GREY },
            emission: Vec3::ZERO,
        });
        self.default = Some(index);
        index
    }

    /// The number of a `<material>` element.
    pub fn get(&mut self, element: Node<'a>, notes: &mut Vec<Note>) -> Result<u32> {
        if let Some(index) = self.by_element.get(&element.id()) {
            return Ok(*index);
        }
        let document = self.document;
        let instance = document.required(element, "instance_effect")?;
        let effect_element = document.resolve(instance, "url", "effect")?;
        let name = document.name(element);
        let effect = match self.effects.get(&effect_element.id()) {
            Some(effect) => effect.clone(),
            None => {
                let effect = EffectReader { document, effect: effect_element, material: &name, notes }.read()?;
                self.effects.insert(effect_element.id(), effect.clone());
                effect
            }
        };
        let at = document.at(effect_element);
        let index = self.add(MaterialDescription { name, at, surface: effect.surface, emission: effect.emission });
        self.by_element.insert(element.id(), index);
        Ok(index)
    }

    /// Whether a material emits.
    pub fn emits(&self, index: u32) -> bool {
        self.descriptions[index as usize].emission != Vec3::ZERO
    }

    fn add(&mut self, description: MaterialDescription) -> u32 {
        // As many as there are elements in the document at most.
        let index = self.descriptions.len() as u32;
        self.descriptions.push(description);
        index
    }
}

/// Reads one effect.
struct EffectReader<'r, 'd, 'a> {
    document: &'d Document<'a>,
    effect: Node<'a>,
    /// The first material that uses it, for messages.
    material: &'r str,
    notes: &'r mut Vec<Note>,
}

impl<'a> EffectReader<'_, '_, 'a> {
    fn read(mut self) -> Result<Effect> {
        let mut effect = self.common_profile()?;
        // The extra may stand below the effect, its profile or its technique.
        for technique in self.effect.descendants().filter(|node| is_course_technique(*node)) {
            for element in technique.children().filter(|child| child.is_element()) {
                self.course_element(element, &mut effect)?;
            }
        }
        Ok(effect)
    }

    /// The shader of `<profile_COMMON>`, as a diffuse surface that may emit.
    fn common_profile(&mut self) -> Result<Effect> {
        let document = self.document;
        let profile = document.child(self.effect, "profile_COMMON");
        let technique = profile.and_then(|profile| document.child(profile, "technique"));
        let shader = technique.and_then(|technique| {
            let shaders = ["phong", "lambert", "blinn", "constant"];
            technique.children().find(|child| child.is_element() && shaders.contains(&child.tag_name().name()))
        });
        let Some(shader) = shader else {
            let grey = Effect { surface: Surface::Diffuse { albedo: MID_GREY }, emission: Vec3::ZERO };
            // An effect that consists of the course's extra alone lacks nothing.
            if !self.effect.descendants().any(is_course_technique) {
                self.warn(self.effect, "has no phong, lambert, blinn or constant shader: it becomes mid-grey");
            }
            return Ok(grey);
        };
        let emission = self.shader_color(shader, "emission", Vec3::ZERO)?.unwrap_or(Vec3::ZERO);
        let diffuse = match shader.tag_name().name() {
            "constant" => None,
            _ => self.shader_color(shader, "diffuse", MID_GREY)?,
        };
        Ok(Effect { surface: Surface::Diffuse { albedo: diffuse.unwrap_or(Vec3::ZERO) }, emission })
    }

    /// A shader's colour: stated, by reference to a parameter, or `textured` if it is a texture.
    fn shader_color(&mut self, shader: Node<'a>, name: &str, textured: Vec3) -> Result<Option<Vec3>> {
        let document = self.document;
        let Some(element) = document.child(shader, name) else { return Ok(None) };
        if let Some(color) = document.child(element, "color") {
            return document.color(color).map(Some);
        }
        if let Some(texture) = document.child(element, "texture") {
            let instead = if textured == Vec3::ZERO { "none" } else { "mid-grey" };
            self.warn(texture, &format!("has a texture as its {name} colour: it becomes {instead}"));
            return Ok(Some(textured));
        }
        let Some(reference) = document.child(element, "param") else { return Ok(None) };
        let sid = document.required_attribute(reference, "ref")?;
        let parameters =
            self.effect.descendants().filter(|node| node.is_element() && node.tag_name().name() == "newparam");
        let Some(parameter) = parameters.into_iter().find(|node| node.attribute("sid") == Some(sid)) else {
            let what = format!("no parameter \"{}\" in this effect", clip(sid));
            return Err(document.expected(reference, what, "the sid of a <newparam>"));
        };
        let Some(value) = document.child(parameter, "float3").or_else(|| document.child(parameter, "float4")) else {
            return Err(document.expected(parameter, "a parameter that is no colour", "<float3> or <float4>"));
        };
        document.color(value).map(Some)
    }

    /// One element of a course technique.
    fn course_element(&mut self, element: Node<'a>, effect: &mut Effect) -> Result<()> {
        let kind = element.tag_name().name();
        match kind {
            // The course's emitters do not scatter.
            "emission" => {
                effect.emission = self.color(element, "radiance")?;
                effect.surface = Surface::Diffuse { albedo: Vec3::ZERO };
            }
            "mirror" => effect.surface = Surface::Mirror { reflectance: self.color(element, "reflectance")? },
            "refraction" => {
                let (transmittance, ior) = (self.color(element, "transmittance")?, self.ior(element)?);
                self.note_roughness(element)?;
                effect.surface = Surface::Refraction { transmittance, ior };
            }
            "glass" => {
                let reflectance = self.color(element, "reflectance")?;
                let (transmittance, ior) = (self.color(element, "transmittance")?, self.ior(element)?);
                self.note_roughness(element)?;
                effect.surface = Surface::Glass { reflectance, transmittance, ior };
            }
            "microfacet" => {
                let roughness = if self.document.child(element, "alpha").is_some() { "alpha" } else { "roughness" };
                let alpha = self.positive(element, roughness)?;
                let (eta, k) = (self.color(element, "eta")?, self.color(element, "k")?);
                effect.surface = Surface::Microfacet { alpha, eta, k };
            }
            _ => self.warn(element, &format!("uses <{}>, which is not known: left out", clip(kind))),
        }
        Ok(())
    }

    fn color(&self, element: Node<'a>, name: &str) -> Result<Vec3> {
        self.document.color(self.document.required(element, name)?)
    }

    fn ior(&self, element: Node<'a>) -> Result<f32> {
        self.positive(element, "ior")
    }

    fn positive(&self, element: Node<'a>, name: &str) -> Result<f32> {
        let element = self.document.required(element, name)?;
        let value = self.document.float(element)? as f32;
        if value > 0.0 && value.is_finite() {
            Ok(value)
        } else {
            Err(self.document.expected(element, format!("<{name}> of {value}"), "a finite number above 0"))
        }
    }

    /// The course's renderer ignores the roughness of its smooth materials too.
    fn note_roughness(&mut self, element: Node<'a>) -> Result<()> {
        if let Some(roughness) = self.document.child(element, "roughness")
            && self.document.float(roughness)? != 0.0
        {
            self.warn(roughness, &format!("has a rough <{}>: it becomes smooth", element.tag_name().name()));
        }
        Ok(())
    }

    fn warn(&mut self, element: Node<'a>, what: &str) {
        let line = self.document.line(element);
        self.notes.push(Note::warning(format!("line {line}: material {} {what}", self.material)));
    }
}
