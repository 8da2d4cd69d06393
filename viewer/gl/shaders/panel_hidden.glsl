// Occlusion of a softbox at a sample, cell by cell; twin of environment_light._of_panel. Needs panel.glsl, hidden.glsl.

vec3 cell_to[PANEL_CELLS];
float cell_angle[PANEL_CELLS];      // solid angle
float cell_sharpness[PANEL_CELLS];
float cell_distance[PANEL_CELLS];   // signed, to the nearest occlusion boundary

void look_at_cells(Hiding hiding) {
    for (int j = 0; j < PANEL_CELLS; ++j) {
        vec3 offset = panel_cells[j] - panel_from;
        float squared = max(dot(offset, offset), 1e-30);
        cell_to[j] = offset * inversesqrt(squared);
        cell_angle[j] = min(panel_cell_area * abs(dot(cell_to[j], panel_facing)) / squared, 2.0 * PI);
        cell_sharpness[j] = max(12.0 / max(cell_angle[j], 1e-12), 1.0);
        cell_distance[j] = signed_distance(hiding, cell_to[j]);
    }
}

// Subtract the occluded light from illuminance and its moments.
void hide_cells(Hiding hiding, mat3 to_world, inout vec4 lux[BENT]) {
    float given = 0.0, hidden[BENT], free = 0.0;
    for (int b = 0; b < BENT; ++b) hidden[b] = 0.0;
    for (int j = 0; j < PANEL_CELLS; ++j) {
        vec3 p = cell_to[j] * to_world;
        float share = min(free_share(cell_distance[j], cell_sharpness[j]),
            share_above(dot(hiding.facet, cell_to[j]), p.z, cell_sharpness[j]));
        float bent[9] = float[9](1.0, p.x, p.y, p.z, p.x * p.y, p.y * p.z, p.x * p.z, p.x * p.x - p.y * p.y,
            3.0 * p.z * p.z - 1.0);
        float weight = cell_angle[j] * max(p.z, 0.0);
        given += weight;
        free += share / float(PANEL_CELLS);
        for (int b = 0; b < BENT; ++b) hidden[b] += (1.0 - share) * weight * bent[b];
    }
    float whole = lux[0].x;
    for (int b = 0; b < BENT; ++b) lux[b].x = given > 0.0 ? lux[b].x - whole / given * hidden[b] : free * lux[b].x;
}

// Free share of a lobe's light from the panel; `angle` is the signed distance at its axis.
float free_of_cells(vec3 to, float lambda, float angle) {
    float least = 1e30, seen = 0.0, free = 0.0;
    for (int j = 0; j < PANEL_CELLS; ++j) {
        float both = lambda + cell_sharpness[j];
        vec3 apart = to - cell_to[j];
        least = min(least, lambda * cell_sharpness[j] / both * 0.5 * dot(apart, apart));
    }
    for (int j = 0; j < PANEL_CELLS; ++j) {
        float both = lambda + cell_sharpness[j], narrower = lambda * cell_sharpness[j] / both;
        vec3 apart = to - cell_to[j];
        float weight = cell_angle[j] * narrower * exp(least - narrower * 0.5 * dot(apart, apart));
        seen += weight;
        free += weight * free_share(mix(angle, cell_distance[j], cell_sharpness[j] / both), both);
    }
    return seen > 0.0 ? free / seen : 1.0;
}
