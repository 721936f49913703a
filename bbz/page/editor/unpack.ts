// The package that unpacks the playground's module.
export { XzReadableStream } from "xz-decompress";
