// Colour differences without angles, in single precision; twin of spectral.image_difference and spectral.image_cam16.
// Values beyond single precision are infinite.

const float NO_NUMBER = uintBitsToFloat(0x7f800000u);

float seventh(float c) {
    float squared = c * c;
    return squared * squared * squared * c;
}

float saturation(float chroma) {
    float power = seventh(chroma);
    return sqrt(power / (power + 6103515625.0));
}

// One Newton step reduces the error of the hardware's powers to rounding.
float cube_root(float x) {
    float root = pow(x, 1.0 / 3.0);
    return root - (root * root * root - x) / (3.0 * root * root);
}

// CIELAB from XYZ relative to the white (CIE 015:2018 eq. 8.3-8.5).
vec3 lab_from_shares(vec3 share) {
    vec3 f;
    for (int k = 0; k < 3; ++k)
        f[k] = share[k] > 0.008856451679 ? cube_root(share[k]) : share[k] * (841.0 / 108.0) + 16.0 / 116.0;
    return vec3(116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z));
}

// CIE 116-1995. The hue difference is computed from the cross product, to avoid cancellation.
float difference_1994(vec3 reference, vec3 sampled) {
    vec2 a = reference.yz, b = sampled.yz;
    float lightness = sampled.x - reference.x, chroma = length(a), other = length(b);
    float along = other - chroma, inner = dot(a, b), turned = a.x * b.y - a.y * b.x, product = chroma * other;
    float hue = inner > 0.0 ? 2.0 * turned * turned / (product + inner) : 2.0 * (product - inner);
    along /= 1.0 + 0.045 * chroma;
    float scale = 1.0 + 0.015 * chroma;
    return sqrt(lightness * lightness + along * along + max(hue, 0.0) / (scale * scale));
}

// CIE 142-2001 (Sharma, Wu and Dalal 2005, eq. 2-22).
float difference_2000(vec3 reference, vec3 sampled) {
    vec2 a = reference.yz, b = sampled.yz;
    float grow = 1.0 + 0.5 * (1.0 - saturation(0.5 * (length(a) + length(b))));
    a.x *= grow;
    b.x *= grow;
    float chroma_1 = length(a), chroma_2 = length(b);
    float product = chroma_1 * chroma_2, inner = dot(a, b), turned = a.x * b.y - a.y * b.x;
    bool beyond = inner < 0.0;
    // The mean of nearly opposite hues is undefined in single precision.
    if (beyond && abs(turned) < 2e-2 * product) return NO_NUMBER;
    float hue = beyond ? sqrt(2.0 * (product - inner)) * (turned < 0.0 ? -1.0 : 1.0)
        : turned * sqrt(2.0 / max(product + inner, 1e-30));

    vec2 direction = a * chroma_2 + b * chroma_1;
    float size = length(direction);
    direction /= size > 0.0 ? size : 1.0;
    float c = direction.x, s = direction.y, mean = 0.5 * (chroma_1 + chroma_2);
    float c2 = 2.0 * c * c - 1.0, s2 = 2.0 * s * c;
    float c3 = c * (2.0 * c2 - 1.0), s3 = s * (2.0 * c2 + 1.0);
    float c4 = 2.0 * c2 * c2 - 1.0, s4 = 2.0 * s2 * c2;
    float t = 1.0 - 0.17 * (c * cos(radians(30.0)) + s * sin(radians(30.0))) + 0.24 * c2
        + 0.32 * (c3 * cos(radians(6.0)) - s3 * sin(radians(6.0)))
        - 0.20 * (c4 * cos(radians(63.0)) + s4 * sin(radians(63.0)));

    // Squared angle to 275 degrees, by its series in 1 - cosine; beyond a right angle its effect is negligible.
    float x = 1.0 - (c * cos(radians(275.0)) + s * sin(radians(275.0)));
    float squared = ((((16.0 / 1575.0 * x + 1.0 / 35.0) * x + 4.0 / 45.0) * x + 1.0 / 3.0) * x + 2.0) * x;
    float blue = exp(-squared * degrees(1.0) * degrees(1.0) / 625.0);
    float rotation = -2.0 * saturation(mean) * sin(radians(60.0) * blue);

    float offset = 0.5 * (reference.x + sampled.x) - 50.0;
    offset *= offset;
    float lightness = (sampled.x - reference.x) / (1.0 + 0.015 * offset / sqrt(20.0 + offset));
    float chroma = (chroma_2 - chroma_1) / (1.0 + 0.045 * mean);
    hue /= 1.0 + 0.015 * mean * t;
    return sqrt(max(lightness * lightness + chroma * chroma + hue * hue + rotation * chroma * hue, 0.0));
}

// CAM16-UCS (C. Li et al. 2017), of one white: see `cam16_constants`.
uniform mat3 cones_from_share;
uniform float brightest, exponent, colourful, induction;

float log_of_one_and(float x) {
    if (abs(x) < 0.01) return x * (1.0 - x * (0.5 - x * (1.0 / 3.0 - 0.25 * x)));
    return log(1.0 + x);
}

float achromatic(vec3 response) { return 2.0 * response.x + response.y + 0.05 * response.z; }

vec3 signed_power(vec3 x, float power) { return sign(x) * pow(abs(x), vec3(power)); }

// J', a', b'; infinite where single precision is insufficient.
vec3 appearance(vec3 share) {
    vec3 cones = cones_from_share * share;
    vec3 power = pow(abs(cones), vec3(0.42));
    vec3 response = sign(cones) * 400.0 * power / (power + 27.13);
    vec2 opponent = vec2(response.x - 12.0 / 11.0 * response.y + response.z / 11.0,
        (response.x + response.y - 2.0 * response.z) / 9.0);
    float size = length(opponent), bright = achromatic(response) / brightest;
    float below = response.x + response.y + 1.05 * response.z + 0.305;
    float turned = (opponent.x * cos(2.0) - opponent.y * sin(2.0) + 3.8 * size) * induction / below;
    float lightness = sign(bright) * pow(abs(bright), exponent);
    float chroma = colourful * pow(abs(turned), 0.9) * pow(abs(bright), 0.5 * exponent) * sign(turned) * sign(bright);
    float log_chroma = log_of_one_and(0.0228 * chroma);
    float j = 1.7 * 100.0 * lightness / (1.0 + 0.7 * lightness);
    if (!(abs(log_chroma) <= (abs(j) < 1.0 ? 0.0228 * 10.0 : 0.0228 * 100.0))) return vec3(NO_NUMBER);
    // Without length, hue and chroma are zero.
    return vec3(j, log_chroma / (0.0228 * max(size, 1e-30)) * opponent);
}

float difference_cam16(vec3 reference, vec3 sampled) {
    vec3 first = appearance(reference), second = appearance(sampled);
    return isinf(first.x) || isinf(second.x) ? NO_NUMBER : distance(first, second);
}
