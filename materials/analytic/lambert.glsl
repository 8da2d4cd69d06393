// The perfectly diffuse surface: f_r = rho / pi (Lambert 1760), in 1/sr at one wavelength.
float lambert(vec3 wi, vec3 wo, float reflectance)
{
    if (wi.z <= 0.0 || wo.z <= 0.0)
        return 0.0;
    return reflectance / 3.14159265358979;
}
