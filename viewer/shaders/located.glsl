// Where a sample stands among the vertices of its part, as those were divided; twin of Refinement.located.

uniform sampler2D standing;     // of every sample: the weights of its triangle's second and third corner
uniform sampler2D faces;        // of every triangle of the window: its number in the scene + 1, negative where its back
                                // is seen, and its normal on the viewer's side
uniform isampler2D nodes;       // of every triangle of the scene: the vertices that its parts have; of one that has no
                                // parts where its first cut stands, and of cuts what light_tables._nodes says
uniform isampler2D sites_of;    // of every vertex its site in front and behind, -1 inside of solids
uniform ivec4 division;         // of the part: first triangle, where its nodes begin, parts a side, numbers a triangle

int node(int number) { return texelFetch(nodes, ivec2(number % ROW_LENGTH, number / ROW_LENGTH), 0).x; }

// Three vertices near a point, by the weights of its triangle's second and third corner; twin of Refinement.located.
void locate(int triangle, vec2 place, out int corners[3], out float weights[3]) {
    int first = division.y + (triangle - division.x) * division.w, side = division.z;
    if (side > 1) {
        place *= float(side);
        int b = clamp(int(floor(place.y)), 0, side - 1);
        int a = clamp(int(floor(place.x)), 0, side - 1 - b);
        vec2 part = place - vec2(a, b);
        bool upper = part.x + part.y > 1.0;
        int row = first + b * (side + 1) - b * (b - 1) / 2 + a, above = row + side + 1 - b;
        corners = int[3](upper ? above + 1 : row, row + 1, above);
        for (int c = 0; c < 3; ++c) corners[c] = node(corners[c]);
        weights = upper ? float[3](part.x + part.y - 1.0, 1.0 - part.y, 1.0 - part.x)
            : float[3](1.0 - part.x - part.y, part.x, part.y);
        return;
    }
    for (int c = 0; c < 3; ++c) corners[c] = node(first + c);
    weights = float[3](1.0 - place.x - place.y, place.x, place.y);
    for (int cut = node(first + 3); cut >= 0;) {
        int c = node(cut), p = (c + 1) % 3, q = (c + 2) % 3;
        float near = weights[p], far = weights[q];
        bool nearer = near >= far;
        corners[nearer ? q : p] = node(cut + 1);
        weights[p] = nearer ? near - far : 2.0 * near;
        weights[q] = nearer ? 2.0 * far : far - near;
        cut = node(cut + (nearer ? 2 : 3));
    }
}

// The three sites near a sample, on the side that is seen, and their weights; -1 inside of solids.
void sites_near(int number, ivec2 sample_at, out vec4 face, out int near[3], out float weights[3]) {
    face = texelFetch(faces, ivec2((number - 1) % ROW_LENGTH, (number - 1) / ROW_LENGTH), 0);
    locate(int(abs(face.x)) - 1, texelFetch(standing, sample_at, 0).xy, near, weights);
    for (int c = 0; c < 3; ++c) {
        ivec2 both = texelFetch(sites_of, ivec2(near[c] % ROW_LENGTH, near[c] / ROW_LENGTH), 0).xy;
        near[c] = face.x < 0.0 ? both.y : both.x;
    }
}
