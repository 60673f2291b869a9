// An arrow from its group's origin, whose length is a number times a scale.

import { ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, Vector3 } from "three";

const UP = new Vector3(0, 0, 1);
const FLIPPED = new Vector3();
const LEAST = 0.02; // of the thickest arrow's length: shorter ones are not drawn

export class Arrow {
  /** thickness in m; scale in m per unit of what it shows */
  constructor(colour, thickness, scale) {
    this.thickness = thickness;
    this.scale = scale;
    const overAll = { depthTest: false, transparent: true, opacity: 0.88 };
    const material = new MeshBasicMaterial({ color: colour, ...overAll });
    this.shaft = new Mesh(
      new CylinderGeometry(thickness, thickness, 1, 16).translate(0, 0.5, 0).rotateX(Math.PI / 2),
      material,
    );
    this.head = new Mesh(
      new ConeGeometry(2.6 * thickness, 6 * thickness, 20).translate(0, -3 * thickness, 0).rotateX(Math.PI / 2),
      material,
    );
    this.shaft.renderOrder = this.head.renderOrder = 2;
    this.group = new Group();
    this.group.add(this.shaft, this.head);
  }

  set(vector, visible) {
    const length = this.scale * vector.length();
    this.group.visible = visible && length > LEAST * this.thickness;
    if (!this.group.visible) return;
    this.group.quaternion.setFromUnitVectors(UP, FLIPPED.copy(vector).normalize());
    const head = Math.min(1, length / (9 * this.thickness)); // short arrows have small heads
    this.head.scale.setScalar(head);
    this.head.position.z = length;
    this.shaft.scale.set(head, head, Math.max(length - 6 * this.thickness * head, 1e-9));
  }
}
