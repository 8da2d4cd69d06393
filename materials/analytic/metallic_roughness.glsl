// The BRDF of the glTF 2.0 specification (Khronos 2021), appendix B.3.5, with its extensions specular and clearcoat.

// D G / (4 cos_i cos_o) of GGX with Smith's one-sided terms (Walter et al., EGSR 2007, eq. 33 and 34).
float metallic_roughness_facets(vec3 wi, vec3 wo, vec3 h, float alpha)
{
    float length2 = dot(h, h);
    float spread = (h.z * h.z * alpha * alpha + dot(h.xy, h.xy)) / length2;
    float density = alpha * alpha / (3.14159265358979 * spread * spread);
    float lit = wi.z + length(vec2(wi.z, alpha * length(wi.xy)));
    float seen = wo.z + length(vec2(wo.z, alpha * length(wo.xy)));
    return density / (lit * seen);
}

// f_r in 1/sr at one wavelength: a body of albedo `diffuse` under facets of Fresnel reflectance `specular` at the normal
// and `edge` at grazing, under a coat of refractive index 1.5.
float metallic_roughness(
    vec3 wi, vec3 wo, float diffuse, float specular, float edge, float alpha, float coat, float coat_alpha)
{
    if (wi.z <= 0.0 || wo.z <= 0.0)
        return 0.0;
    vec3 h = wi + wo, d = wi - wo;
    // 1 - cos = sin^2 / (1 + cos), and |wi - wo| = 2 sin: no cancellation near retro-reflection.
    float lost = 0.25 * dot(d, d) / (1.0 + 0.5 * length(h));
    float fall = lost * lost * lost * lost * lost;
    float fresnel = specular + (edge - specular) * fall;
    float coated = coat * (0.04 + 0.96 * fall);
    float base = (1.0 - fresnel) * diffuse / 3.14159265358979
        + fresnel * metallic_roughness_facets(wi, wo, h, alpha);
    float top = coat > 0.0 ? coated * metallic_roughness_facets(wi, wo, h, coat_alpha) : 0.0;
    return (1.0 - coated) * base + top;
}
