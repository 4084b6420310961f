// Stub of the parts of glTFast (6.14, Apache-2.0) that the importer uses. Names are glTFast's own. Like glTFast, the stub
// makes an object of the .glb's node, mirrored in x, with a renderer and a material. Loading is asynchronous, too.
using System;
using System.Text;
using System.Threading;
using System.Threading.Tasks;
using Newtonsoft.Json.Linq;
using UnityEngine;

namespace GLTFast
{
    public enum NameImportMethod { Original, OriginalUnique }

    public class ImportSettings
    {
        public NameImportMethod NodeNameMethod { get; set; }
        public bool GenerateMipMaps { get; set; }
    }

    namespace Loading { public interface IDownloadProvider { } }
    namespace Materials { public interface IMaterialGenerator { } }
    namespace Logging { public interface ICodeLogger { } }
    public interface IDeferAgent { }
    public class UninterruptedDeferAgent : IDeferAgent { }

    public class GltfImport : IDisposable
    {
        public static bool IsThere = true;  // only in the stub: whether the project has the packages that the files need
        public static float MirrorX = -1;  // only in the stub; 1 imitates an importer that does not mirror
        JObject json;

        public GltfImport(Loading.IDownloadProvider downloadProvider = null, IDeferAgent deferAgent = null, Materials.IMaterialGenerator materialGenerator = null, Logging.ICodeLogger logger = null) { }

        public async Task<bool> Load(byte[] data, Uri uri = null, ImportSettings importSettings = null, CancellationToken cancellationToken = default(CancellationToken))
        {
            var thread = Thread.CurrentThread;
            await Task.Run(() => Thread.Sleep(1));
            if (Thread.CurrentThread != thread) throw new InvalidOperationException("Unity's objects are made on the main thread alone");
            json = JObject.Parse(Encoding.UTF8.GetString(data, 20, BitConverter.ToInt32(data, 12)));
            return IsThere;
        }

        public async Task<bool> InstantiateMainSceneAsync(Transform parent, CancellationToken cancellationToken = default(CancellationToken))
        {
            await Task.Yield();
            var node = json["nodes"][0];
            var made = new GameObject((string)node["name"]);
            var at = node["translation"] == null ? new float[3] : node["translation"].ToObject<float[]>();
            var scale = node["scale"] == null ? new float[] { 1, 1, 1 } : node["scale"].ToObject<float[]>();
            made.transform.localPosition = new Vector3(MirrorX * at[0], at[1], at[2]);
            made.transform.localScale = new Vector3(scale[0], scale[1], scale[2]);
            float[] min = json["accessors"][0]["min"].ToObject<float[]>(), max = json["accessors"][0]["max"].ToObject<float[]>();
            var mesh = new Mesh { vertices = new[] { new Vector3(MirrorX * max[0], min[1], min[2]), new Vector3(MirrorX * min[0], max[1], max[2]) } };
            made.AddComponent<MeshFilter>().sharedMesh = mesh;
            made.AddComponent<MeshRenderer>().sharedMaterial = new Material((Shader)null);
            made.transform.SetParent(parent, false);
            return true;
        }

        public int TextureCount { get { return 0; } }
        public Texture2D GetTexture(int index = 0) { return null; }
        public void DisposeRequiredForInstantiationData() { }
        public void Dispose() { }
    }
}
