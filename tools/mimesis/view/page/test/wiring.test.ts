import { expect, test } from "vitest";
import { imageOf, type Start } from "../src/wiring";

const image = (topic: string, port: string) => ({ topic, port, type: "foxglove.RawImage" });
const nodes: Start[] = [
  { node: "vision", inputs: [image("camera/image", "image"), image("camera/right", "right")], outputs: [{ topic: "vision/annotations", port: "annotations", type: "foxglove.ImageAnnotations" }] },
  { node: "robot_vision", inputs: [image("eye/image", "image"), image("eye/right", "right")], outputs: [{ topic: "robot_vision/annotations", port: "annotations", type: "foxglove.ImageAnnotations" }] },
];
const all = ["camera/image", "camera/right", "eye/image", "eye/right"];

test("annotations lie on the image that their node was given, and on no other", () => {
  expect(imageOf("vision/annotations", all, nodes)).toBe("camera/image");
  expect(imageOf("robot_vision/annotations", all, nodes)).toBe("eye/image");
  expect(imageOf("robot_vision/annotations", ["camera/image"], nodes)).toBeUndefined(); // its image is not there
});

test("of nodes that tell nothing, the path tells", () => {
  const cars = ["/CAM_BACK/image_rect_compressed", "/CAM_FRONT/image_rect_compressed", "/CAM_FRONT_LEFT/image_rect_compressed"]; // nuScenes
  expect(imageOf("/CAM_FRONT/annotations", cars, [])).toBe("/CAM_FRONT/image_rect_compressed");
  expect(imageOf("/CAM_FRONT_LEFT/annotations", cars, [])).toBe("/CAM_FRONT_LEFT/image_rect_compressed");
  expect(imageOf("/detections", cars, [])).toBeUndefined(); // not drawn on all
  expect(imageOf("/detections", ["/camera"], [])).toBe("/camera");
});
