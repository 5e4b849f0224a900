// The camera at the cursor: its frustum with the frame it saw as the far end, and where the estimate thinks it was.

import {
  BufferAttribute, BufferGeometry, CanvasTexture, DoubleSide, Group, LinearFilter, LineBasicMaterial, LineSegments, Mesh,
  MeshBasicMaterial, Quaternion, SphereGeometry, SRGBColorSpace,
} from "three";

import {element} from "../dom.js";

const kReach_mm = 14;  // from the camera to the frame
const kEdges = [0, 1, 0, 2, 0, 3, 0, 4, 1, 2, 2, 3, 3, 4, 4, 1];

/** [x, y, z, qx, qy, qz, qw] of world_from_camera. */
export function placeAt(object, pose) {
  object.position.set(...pose.slice(0, 3));
  object.quaternion.copy(new Quaternion(...pose.slice(3)));
}

function frustum(cornerRays, material) {
  const group = new Group();
  group.add(new Mesh(new SphereGeometry(1.7, 20, 14), new MeshBasicMaterial({color: material.color})));
  if (!cornerRays.length) return group;
  const corners = cornerRays.map((ray) => ray.map((v) => v * kReach_mm));
  const positions = new Float32Array([0, 0, 0, ...corners.flat()]);
  const edges = new BufferGeometry();
  edges.setAttribute("position", new BufferAttribute(positions, 3));
  edges.setIndex(kEdges);
  group.add(new LineSegments(edges, material));
  group.corners = corners;
  return group;
}

function screen(corners) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(corners.flat()), 3));
  geometry.setAttribute("uv", new BufferAttribute(new Float32Array([0, 1, 1, 1, 1, 0, 0, 0]), 2));
  geometry.setIndex([0, 1, 2, 0, 2, 3]);
  return new Mesh(geometry, new MeshBasicMaterial({side: DoubleSide, transparent: true, opacity: 0.94}));
}

export class Capsule {
  constructor(cornerRays) {
    this.group = new Group();
    this.trueMaterial = new LineBasicMaterial();
    this.estimateMaterial = new LineBasicMaterial();
    this.truth = frustum(cornerRays, this.trueMaterial);
    this.estimate = frustum(cornerRays, this.estimateMaterial);
    this.group.add(this.truth, this.estimate);
    if (this.truth.corners) {
      this.screen = screen(this.truth.corners);
      this.screen.visible = false;
      this.truth.add(this.screen);
    }
  }

  /** Moves to a stop of the view's data. */
  show(stop) {
    placeAt(this.truth, stop.pose);
    this.estimate.visible = stop.estimate !== null;
    if (stop.estimate) placeAt(this.estimate, stop.estimate);
  }

  /** `picture` is an <img> that has loaded. */
  project(picture) {
    if (!this.screen) return;
    const {material} = this.screen, {naturalWidth: width, naturalHeight: height} = picture;
    if (!material.map) {
      this.paper = element("canvas", {width, height});
      material.map = new CanvasTexture(this.paper);
      material.map.colorSpace = SRGBColorSpace;
      material.map.generateMipmaps = false;
      material.map.minFilter = LinearFilter;
      material.needsUpdate = true;
    }
    this.paper.getContext("2d").drawImage(picture, 0, 0);
    material.map.needsUpdate = true;
    this.screen.visible = true;
  }

  tint(truth, estimate) {
    for (const [part, material, css] of [[this.truth, this.trueMaterial, truth],
                                         [this.estimate, this.estimateMaterial, estimate]]) {
      material.color.set(css);
      part.children[0].material.color.set(css);
    }
  }
}
