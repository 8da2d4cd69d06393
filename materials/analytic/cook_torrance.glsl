// Cook and Torrance, "A reflectance model for computer graphics", ACM Transactions on Graphics 1(1), 1982, with the
// normalisation of Walter, Marschner, Li and Torrance, "Microfacet models for refraction through rough surfaces",
// EGSR 2007.

// Unpolarised Fresnel reflectance from n + ik (Born and Wolf, Principles of Optics, section 14.2):
// a + ib = sqrt((n + ik)^2 - sin^2); whichever of a^2, b^2 would cancel comes from a b = n k.
float cook_torrance_fresnel(float cos2, float sin2, float eta, float k)
{
    float c = sqrt(cos2);
    float real = (eta - k) * (eta + k) - sin2;
    float product = eta * k;
    float large = 0.5 * (length(vec2(real, 2.0 * product)) + abs(real));
    float small = large > 0.0 ? product * product / large : 0.0;
    float a = sqrt(real >= 0.0 ? large : small), b2 = real >= 0.0 ? small : large;
    float ac = a * c, b2c2 = b2 * cos2;
    float across = ((a - c) * (a - c) + b2) / ((a + c) * (a + c) + b2);
    float ratio = ((ac - sin2) * (ac - sin2) + b2c2) / ((ac + sin2) * (ac + sin2) + b2c2);
    return 0.5 * across * (1.0 + ratio);
}

// G1 / (2 cos): Walter et al. eq. 34 (GGX, exact) and eq. 27 (Beckmann, rational), the cosine cancelled.
float cook_torrance_smith(float c, float s, float roughness, int distribution)
{
    float slope = roughness * s;
    if (distribution == 1)
        return 1.0 / (c + length(vec2(c, slope)));
    if (c >= 1.6 * slope)
        return 0.5 / c;
    float a = c / slope;
    return 0.5 * (3.535 + 2.181 * a) / ((1.0 + 2.276 * a + 2.577 * a * a) * slope);
}

// f_r in 1/sr at one wavelength: s F D G / (4 cos_i cos_o) + (1 - s) rho / pi.
// distribution: 0 Beckmann (Walter et al. eq. 25), 1 GGX (eq. 33). masking: 0 V-cavities (1982), 1 Smith.
float cook_torrance(
    vec3 wi, vec3 wo, float diffuse, float eta, float k, float roughness, float specular_weight,
    int distribution, int masking)
{
    if (wi.z <= 0.0 || wo.z <= 0.0)
        return 0.0;
    const float PI = 3.14159265358979;
    vec3 h = wi + wo, d = wi - wo;
    float cos2_d = 0.25 * dot(h, h), sin2_d = 0.25 * dot(d, d);
    float cos2_h = 0.25 * h.z * h.z / cos2_d, sin2_h = 0.25 * dot(h.xy, h.xy) / cos2_d;
    float m2 = roughness * roughness;
    float density;
    if (distribution == 0) {
        float tan2 = sin2_h / cos2_h;
        density = exp(-tan2 / m2) * (1.0 + tan2) * (1.0 + tan2) / (PI * m2);
    } else {
        float spread = cos2_h * m2 + sin2_h;
        density = m2 / (PI * spread * spread);
    }
    float masked;
    if (masking == 0)
        masked = min(0.25 / (wi.z * wo.z), 0.5 * sqrt(cos2_h / cos2_d) / max(wi.z, wo.z));
    else
        masked = cook_torrance_smith(wi.z, length(wi.xy), roughness, distribution)
            * cook_torrance_smith(wo.z, length(wo.xy), roughness, distribution);
    return specular_weight * cook_torrance_fresnel(cos2_d, sin2_d, eta, k) * density * masked
        + (1.0 - specular_weight) * diffuse / PI;
}
