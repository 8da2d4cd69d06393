// What a sample sees: position, shading frame and direction to the viewer; twin of surfaces.py.

uniform sampler2D seen;         // triangle number + 1 at every sample, 0 where there is none
uniform sampler2D triangles;    // see resources.triangle_texels
uniform vec3 eye;               // pin-hole, or direction to the viewer of a parallel view
uniform bool perspective;

const float LEAST_COSINE = 1e-3;

struct Surface {
    int face;           // triangle of the scene
    vec3 position;      // in radii about the scene's centre
    vec3 to_viewer;
    vec3 tangent, bitangent, normal;    // left-handed where a texture is seen mirrored
    float whole;        // a depth's inverse, up to a factor of the triangle
};

vec4 triangle_texel(int number, int index) {
    return texelFetch(triangles, ivec2((number % TRIANGLES_A_ROW) * TRIANGLE_TEXELS + index, number / TRIANGLES_A_ROW), 0);
}

// a.x b.y - a.y b.x without cancellation, also for thin triangles (Kahan's use of the fused multiply-add).
float cross_product(vec2 a, vec2 b) {
    precise float product = a.y * b.x;
    precise float lost = fma(-a.y, b.x, product);
    precise float difference = fma(a.x, b.y, -product);
    return difference + lost;
}

vec3 to_local(Surface at, vec3 direction) {
    return vec3(dot(at.tangent, direction), dot(at.bitangent, direction), dot(at.normal, direction));
}

vec3 level(vec3 direction, vec3 normal) {
    return direction - dot(direction, normal) * normal;
}

// Twice the signed areas that a point, in 1/256 sample, makes with the sides opposite to each corner.
vec3 areas(vec2 a, vec2 b, vec2 c) {
    return vec3(cross_product(b, c), cross_product(c, a), cross_product(a, b));
}

// At a point of the picture, in 1/256 sample; the plane of a triangle goes on beyond its edges.
Surface surface_at(int number, vec2 point) {
    vec4 corners = triangle_texel(number, 0);
    vec4 rest = triangle_texel(number, 1);
    vec4 p0 = triangle_texel(number, 2), p1 = triangle_texel(number, 3), p2 = triangle_texel(number, 4);
    vec3 weights = areas(corners.xy - point, corners.zw - point, rest.xy - point) * vec3(p0.w, p1.w, p2.w);
    Surface at;
    at.whole = weights.x + weights.y + weights.z;
    weights /= at.whole == 0.0 ? 1.0 : at.whole;
    at.face = int(rest.z);
    at.position = weights.x * p0.xyz + weights.y * p1.xyz + weights.z * p2.xyz;
    at.to_viewer = perspective ? normalize(eye - at.position) : eye;
    vec3 normal = normalize(weights.x * triangle_texel(number, 5).xyz + weights.y * triangle_texel(number, 6).xyz
        + weights.z * triangle_texel(number, 7).xyz);
    normal = normalize(normal + max(LEAST_COSINE - dot(normal, at.to_viewer), 0.0) * at.to_viewer);
    vec3 tangent = weights.x * triangle_texel(number, 8).xyz + weights.y * triangle_texel(number, 9).xyz
        + weights.z * triangle_texel(number, 10).xyz;
    tangent = level(tangent, normal);
    if (dot(tangent, tangent) < 1e-12) {
        tangent = length(normal.xz) < 1e-6 ? vec3(1.0, 0.0, 0.0) : vec3(normal.z, 0.0, -normal.x);
        tangent = level(tangent, normal);
    }
    // Once more at full length: what rounding left along the normal would turn sharp highlights.
    tangent = normalize(level(normalize(tangent), normal));
    at.normal = normal;
    at.tangent = tangent;
    at.bitangent = rest.w * cross(normal, tangent);
    return at;
}
