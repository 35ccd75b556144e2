// Pictures for `mimesis view --film` and `--png`: one for every message on film/time, when all before it is drawn.
import type { Connection } from "./connection";
import { fitting } from "./layouts";
import type { Scene } from "./scene";

export function film(connection: Connection, scene: Scene, query: URLSearchParams) {
  const [width, height] = query.get("size")!.split("x").map(Number);
  const format = query.get("film")!;
  let first = true;
  connection.listen("film/time", async () => {
    const topics = new Set([...connection.channels.value.values()].map((c) => c.topic));
    const camera = query.get("camera") ? query.get("camera")!.split(",").map(Number) : fitting(topics).camera;
    if (first) scene.pose(width!, height!, camera);
    first = false;
    const picture = await scene.picture(`image/${format}`);
    await connection.call("film/picture", { format, data: new Uint8Array(await picture.arrayBuffer()) });
  });
}
