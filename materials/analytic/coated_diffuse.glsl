// A rough dielectric surface over a Lambertian body: Beckmann's facets (Walter et al., EGSR 2007, eq. 25 and 27) with the
// Fresnel reflectance of an index, and Saunderson's body under them (JOSA 32, 1942).

// 1 - F of unpolarised light: 4 a c / (a + c)^2 and 4 n^2 a c / (a + n^2 c)^2, in their mean.
float coated_diffuse_through(float c, float n)
{
    float a = sqrt((n - 1.0) * (n + 1.0) + c * c), across = a + c, along = a + n * n * c;
    return 2.0 * a * c * (1.0 / (across * across) + n * n / (along * along));
}

// Reflectance of the surface under diffuse light (Duntley, JOSA 32, 1942, eq. 30).
float coated_diffuse_fresnel(float n)
{
    float n2 = n * n, n4 = n2 * n2, more = n2 + 1.0, less = n4 - 1.0;
    return 0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0) * (n + 1.0))
        + n2 * (n2 - 1.0) * (n2 - 1.0) / (more * more * more) * log((n - 1.0) / (n + 1.0))
        - 2.0 * n * n2 * (n2 + 2.0 * n - 1.0) / (more * less)
        + 8.0 * n4 * (n4 + 1.0) / (more * less * less) * log(n);
}

// G1 / (2 cos): Walter et al. eq. 27, the cosine cancelled.
float coated_diffuse_seen(float c, float slope)
{
    if (c >= 1.6 * slope)
        return 0.5 / c;
    float a = c / slope;
    return 0.5 * (3.535 + 2.181 * a) / ((1.0 + 2.276 * a + 2.577 * a * a) * slope);
}

// f_r in 1/sr at one wavelength: F D G / (4 cos_i cos_o) + T_i T_o rho / (pi n^2 (1 - R rho)).
float coated_diffuse(vec3 wi, vec3 wo, float diffuse, float index, float roughness)
{
    if (wi.z <= 0.0 || wo.z <= 0.0)
        return 0.0;
    const float PI = 3.14159265358979;
    vec3 h = wi + wo;
    float length2 = dot(h, h), m2 = roughness * roughness, tan2 = dot(h.xy, h.xy) / (h.z * h.z);
    float density = exp(-tan2 / m2) * (1.0 + tan2) * (1.0 + tan2) / (PI * m2);
    density *= coated_diffuse_seen(wi.z, roughness * length(wi.xy)) * coated_diffuse_seen(wo.z, roughness * length(wo.xy));
    float reflected = 1.0 - coated_diffuse_through(min(0.5 * sqrt(length2), 1.0), index);
    float n2 = index * index, returned = 1.0 - (1.0 - coated_diffuse_fresnel(index)) / n2;
    float body = diffuse / (PI * n2 * (1.0 - returned * diffuse));
    return reflected * density
        + body * coated_diffuse_through(wi.z, index) * coated_diffuse_through(wo.z, index);
}
