/** vtk.js: its volume mapper, composite blending, no shading. Setting: sample distance in voxels. */
import "@kitware/vtk.js/Rendering/Profiles/Volume";
import vtkDataArray from "@kitware/vtk.js/Common/Core/DataArray";
import vtkImageData from "@kitware/vtk.js/Common/DataModel/ImageData";
import vtkPiecewiseFunction from "@kitware/vtk.js/Common/DataModel/PiecewiseFunction";
import vtkColorTransferFunction from "@kitware/vtk.js/Rendering/Core/ColorTransferFunction";
import vtkVolume from "@kitware/vtk.js/Rendering/Core/Volume";
import vtkVolumeMapper from "@kitware/vtk.js/Rendering/Core/VolumeMapper";
import vtkGenericRenderWindow from "@kitware/vtk.js/Rendering/Misc/GenericRenderWindow";
import { serve } from "./page";
import { type Camera, type Renderer, type Scene, shownColor, upright } from "./scene";

class Vtk implements Renderer {
  private readonly window = vtkGenericRenderWindow.newInstance({
    background: [0, 0, 0],
    listenWindowResize: false,
  });

  get gl(): WebGL2RenderingContext {
    const gl = this.window.getContainer()?.querySelector("canvas")?.getContext("webgl2");
    if (!gl) throw new Error("vtk.js has no context");
    return gl;
  }

  async setup(scene: Scene, camera: Camera, setting: number, parent: HTMLElement): Promise<void> {
    const { about } = scene;
    const [h] = about.spacing_um;
    const image = vtkImageData.newInstance({
      origin: [0, -(about.size[1] - 1) * about.spacing_um[1], 0],
      spacing: [...about.spacing_um],
    });
    image.setDimensions([...about.size]);
    image.getPointData().setScalars(
      vtkDataArray.newInstance({
        name: "intensity",
        values: upright(scene),
        numberOfComponents: 1,
      }),
    );
    const mapper = vtkVolumeMapper.newInstance();
    mapper.setInputData(image);
    mapper.setAutoAdjustSampleDistances(false);
    mapper.setSampleDistance(setting * h);
    const opacity = vtkPiecewiseFunction.newInstance();
    for (let i = 0; i < 256; i++) opacity.addPoint(i, about.table[4 * i + 3] / 255);
    const color = vtkColorTransferFunction.newInstance();
    const [r, g, b] = shownColor(about);
    color.addRGBPoint(0, r, g, b);
    color.addRGBPoint(255, r, g, b);
    const volume = vtkVolume.newInstance();
    volume.setMapper(mapper);
    const property = volume.getProperty();
    property.setScalarOpacity(0, opacity);
    property.setRGBTransferFunction(0, color);
    property.setScalarOpacityUnitDistance(0, h);
    property.setInterpolationTypeToLinear();
    property.setShade(false);
    const renderer = this.window.getRenderer();
    renderer.addVolume(volume);
    const view = renderer.getActiveCamera();
    view.setPosition(...camera.eye_um);
    view.setFocalPoint(...camera.target_um);
    view.setViewUp(0, 1, 0);
    if (camera.fov_deg !== null) view.setViewAngle(camera.fov_deg);
    else if (camera.half_height_um !== null) {
      view.setParallelProjection(true);
      view.setParallelScale(camera.half_height_um);
    }
    this.window.setContainer(parent);
    this.window.resize();
    renderer.resetCameraClippingRange();
  }

  draw(): void {
    this.window.getRenderWindow().render();
  }
}

serve(() => new Vtk());
