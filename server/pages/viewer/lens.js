// The camera of the picture over the page: where a point is seen, and what a movement there means.

export const add = (a, b, k = 1) => a.map((value, i) => value + k * b[i]);
export const minus = (a, b) => add(a, b, -1);
export const times = (a, k) => a.map(value => value * k);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
export const length = a => Math.hypot(...a);
export const unit = a => times(a, 1 / (length(a) || 1));

/** Two unit vectors across a direction, the second as near to `up` as can be. */
export function across(forward, up = [0, 1, 0]) {
  const tries = [up, [0, 1, 0], [0, 0, 1]];
  const given = tries.find(v => length(cross(forward, v)) > 1e-6 * length(v)) ?? [1, 0, 0];
  const right = unit(cross(forward, given));
  return [right, cross(right, forward)];
}

export class Lens {
  /**
   * @param camera As in a request: `eye`, `target`, `up`, `fov_y_deg`.
   * @param box Width and height of the element, CSS pixels.
   * @param picture Width and height of the image, which is fitted into the box, in the middle.
   */
  constructor({ eye, target, up, fov_y_deg = 45 }, box, picture = box) {
    this.eye = eye;
    this.forward = unit(minus(target, eye));
    [this.right, this.up] = across(this.forward, up);
    this.middle = [box.width / 2, box.height / 2];
    const fit = Math.min(box.width / picture.width, box.height / picture.height);
    this.half = [picture.width * fit / 2, picture.height * fit / 2];
    this.focal = this.half[1] / Math.tan(fov_y_deg * Math.PI / 360); // px
    this.reach = length(minus(target, eye));
  }

  /** Metres in front of the eye, along its axis. */
  depth(point) {
    return dot(minus(point, this.eye), this.forward);
  }

  /** CSS pixels from the left and top of the box; null for what is not in front of the eye. */
  project(point) {
    const to = minus(point, this.eye), depth = dot(to, this.forward);
    if (depth < 1e-4 * this.reach) return null;
    const scale = this.focal / depth;
    return [this.middle[0] + scale * dot(to, this.right), this.middle[1] - scale * dot(to, this.up)];
  }

  /** Whether a place in the box is in the picture. */
  holds([x, y]) {
    return Math.abs(x - this.middle[0]) <= this.half[0] && Math.abs(y - this.middle[1]) <= this.half[1];
  }

  /** Where a point stands that is not in the picture: on its border, in its direction. */
  border(point, inset) {
    const to = minus(point, this.eye);
    const [x, y] = [dot(to, this.right), -dot(to, this.up)];
    const room = this.half.map(half => Math.max(half - inset, 1));
    const k = Math.min(room[0] / (Math.abs(x) || 1e-9), room[1] / (Math.abs(y) || 1e-9));
    return [this.middle[0] + k * x, this.middle[1] + k * y];
  }

  /** Metres that a pixel spans at the depth of a point; of one that is not seen, no fewer than at the
   * depth that is looked at. */
  metres(point) {
    const seen = this.project(point), depth = this.depth(point);
    return (seen && this.holds(seen) ? depth : Math.max(depth, this.reach)) / this.focal;
  }

  /** A point moved by pixels to the right and down, in the plane of the picture through it. */
  moved(point, dx, dy) {
    const scale = this.metres(point);
    return add(add(point, this.right, dx * scale), this.up, -dy * scale);
  }

  /** Where the line of sight through a place in the box meets a plane; null when it grazes it. */
  meet([x, y], point, normal) {
    const direction = unit(add(add(times(this.forward, this.focal), this.right, x - this.middle[0]),
      this.up, this.middle[1] - y));
    const slope = dot(direction, normal);
    if (Math.abs(slope) < 0.1) return null;
    const far = dot(minus(point, this.eye), normal) / slope;
    return far > 0 ? add(this.eye, direction, far) : null;
  }
}
