// Numbers of a texel of a surface of maps: in `planes`, at `levels`, or alike everywhere, in `constants` from AT_BODY, ...
// on. BODY, REST, FACET, EDGE, NORMAL, SPREAD_XX, _XY, _YY, COVERS, UP and DIFFER are the first planes of each kind, or -1;
// under a clear coat also COAT, COAT_SPREAD, COAT_NORMAL, COAT_UP and COAT_DIFFER.

#include "texels.glsl"

uniform float constants[CONSTANTS];
uniform vec4 placement;         // placement of the picture on the mesh: scale, offset
uniform float cutoff;

#define ROWS ((RANK + 4) / 4)
// The index that is not read must lie inside its array, too.
#define NUMBER(first, k, constant) \
    ((first) < 0 ? constants[min((constant) + (k), CONSTANTS - 1)] : numbers[min(max(first, 0) + (k), PLANES - 1)])

// See facets.turned_to.
vec3 turned_to(vec3 normal, vec3 w) {
    float across = length(normal.yz);
    vec2 lean = across > 0.0 ? normal.zy / across : vec2(1.0, 0.0);
    float up = lean.y * w.y + lean.x * w.z;
    return vec3(across * w.x - normal.x * up, lean.x * w.y - lean.y * w.z, normal.x * w.x + across * up);
}
