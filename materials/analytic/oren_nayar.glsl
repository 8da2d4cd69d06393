// The full model of Oren and Nayar, "Generalization of Lambert's reflectance model", SIGGRAPH 94: the functional
// approximation L1 (coefficients C1, C2, C3) plus the interreflection L2. f_r in 1/sr at one wavelength.
float oren_nayar(vec3 wi, vec3 wo, float reflectance, float sigma)
{
    if (wi.z <= 0.0 || wo.z <= 0.0)
        return 0.0;
    const float PI = 3.14159265358979;
    float sin_i = length(wi.xy), sin_o = length(wo.xy);
    float theta_i = atan(sin_i, wi.z), theta_o = atan(sin_o, wo.z);
    float alpha = max(theta_i, theta_o), beta = min(theta_i, theta_o);
    // Tangents from sines and cosines: near grazing the angle has lost the digits of the cosine.
    float tan_beta = min(sin_i / wi.z, sin_o / wo.z);
    float across = sin_i * sin_o;
    float cos_phi = across > 0.0 ? clamp(dot(wi.xy, wo.xy) / across, -1.0, 1.0) : 0.0;
    float s2 = sigma * sigma;
    float c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
    float bend = 2.0 * beta / PI;
    float c2 = 0.45 * s2 / (s2 + 0.09) * (max(sin_i, sin_o) - (cos_phi < 0.0 ? bend * bend * bend : 0.0));
    float both = 4.0 * alpha * beta / (PI * PI);
    float c3 = 0.125 * s2 / (s2 + 0.09) * both * both;
    float tan_mean = (sin_i + sin_o) / (wi.z + wo.z);
    float direct = c1 + cos_phi * c2 * tan_beta + (1.0 - abs(cos_phi)) * c3 * tan_mean;
    float between = 0.17 * s2 / (s2 + 0.13) * (1.0 - cos_phi * bend * bend);
    return reflectance / PI * max(direct + reflectance * between, 0.0);
}
