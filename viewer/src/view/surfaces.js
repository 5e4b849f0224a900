// The true wall and the reconstructed map. Both wind outwards and show their inner sides alone, so that one looks into the
// organ through the side that is near, and sees the wall all around from within.

import {
  BackSide, BufferAttribute, BufferGeometry, Color, FrontSide, Group, Mesh, MeshLambertMaterial, MeshPhongMaterial,
  ShaderMaterial, SRGBColorSpace,
} from "three";

import {uint16, uint32, uint8} from "./bytes.js";

// Never seen and seen, as in the page's pictures of the wall; paler beside a map, whose colours then speak alone.
const kWall = [[0.58, 0.6, 0.64], [0.86, 0.55, 0.47]], kPaleWall = [[0.66, 0.67, 0.7], [0.95, 0.86, 0.8]];

function geometryOf(packed) {
  const numbers = uint16(packed.points);
  const positions = new Float32Array(numbers.length);
  for (let i = 0; i < numbers.length; ++i) positions[i] = packed.corner_mm[i % 3] + packed.step_mm * numbers[i];
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setIndex(new BufferAttribute((packed.wide ? uint32 : uint16)(packed.triangles), 1));
  geometry.computeVertexNormals();
  return geometry;
}

/** Vertex colours from a share of 255 each, through a list of sRGB colours. */
function coloursOf(shares, colours) {
  const linear = colours.map(([r, g, b]) => new Color().setRGB(r, g, b, SRGBColorSpace));
  const values = new Float32Array(3 * shares.length);
  shares.forEach((share, i) => {
    const at = (share / 255) * (linear.length - 1), low = Math.min(Math.floor(at), linear.length - 2);
    linear[low].clone().lerp(linear[low + 1], at - low).toArray(values, 3 * i);
  });
  return new BufferAttribute(values, 3);
}

/** The side that is near, as thin glass: only its rim shows. */
function glass(geometry) {
  const material = new ShaderMaterial({
    side: FrontSide,
    transparent: true,
    depthWrite: false,
    uniforms: {tint: {value: new Color()}},
    vertexShader: `
      varying float facing;
      void main() {
        vec4 p_eye = modelViewMatrix * vec4(position, 1.0);
        facing = abs(dot(normalize(normalMatrix * normal), normalize(p_eye.xyz)));
        gl_Position = projectionMatrix * p_eye;
      }`,
    fragmentShader: `
      uniform vec3 tint;
      varying float facing;
      void main() { gl_FragColor = vec4(tint, 0.02 + 0.45 * pow(1.0 - facing, 2.5)); }`,
  });
  return new Mesh(geometry, material);
}

/**
 * The wall: rose where the capsule saw it, gray where it never did. `tint(css)` colours the glass, `pale(on)` makes room for
 * the colours of a map.
 */
export function wallOf(packed, seen) {
  const geometry = geometryOf(packed);
  const shares = uint8(seen), full = coloursOf(shares, kWall), paler = coloursOf(shares, kPaleWall);
  const material = new MeshPhongMaterial({vertexColors: true, side: BackSide, shininess: 28, specular: 0x2a1c1a});
  const near = glass(geometry);
  const group = new Group();
  group.add(new Mesh(geometry, material), near);
  group.tint = (css) => near.material.uniforms.tint.value.set(css);
  group.pale = (on) => geometry.setAttribute("color", on ? paler : full);
  group.pale(false);
  group.geometry = geometry;
  return group;
}

/**
 * The map, coloured by its distance to the wall. It is drawn as if it were nearer to the eye by a part of its error, so that
 * the wall it lies behind does not hide it.
 */
export function mapOf(packed, errorColours) {
  const geometry = geometryOf(packed);
  geometry.setAttribute("color", coloursOf(uint8(packed.error), errorColours));
  const material = new MeshLambertMaterial({vertexColors: true, side: BackSide});
  const nearer_mm = Math.min(2 * packed.worst_mm, 12);
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace(
      "#include <project_vertex>",
      `#include <project_vertex>
       float nearer = min(${nearer_mm.toFixed(3)}, -0.5 * mvPosition.z);
       vec4 shifted = projectionMatrix * (mvPosition + vec4(0.0, 0.0, nearer, 0.0));
       gl_Position.z = shifted.z / shifted.w * gl_Position.w;`);
  };
  return new Mesh(geometry, material);
}
